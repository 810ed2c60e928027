"""Measures that control traffic: one a file, each giving the engine plain numbers."""
