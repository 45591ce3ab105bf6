"""Semantic checks of parsed tasks, and loading of task files.

Read in this order: `load.py` and `files.py` (task files by path or name), `diagnose.py` (all errors
of a file at once), `semantics.py` (names, reachable stages), `courses.py`, `names.py` and `ambiguity.py` (one
kind of check each).
"""
