"""The compiled core: platoons at the ends of links, and nothing in between.

Kernels (``records``, ``random``, ``link``, ``node``, ``routes``, ``loop``) know arrays only;
``arrays`` builds these from tables, ``simulation`` runs them and gives tables back.
"""
