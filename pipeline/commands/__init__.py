"""Commands of the command line: each module adds its own to the parser, and does what they say.

A module imports what takes long to load only when its command runs, so that ``uxsim-geo --help``
answers at once.
"""
