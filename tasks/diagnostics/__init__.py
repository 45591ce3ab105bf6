"""Diagnostics of task files: each error has a stable code, a place, and advice.

Read in this order: `codes.py` (every code), `normalise.py` (characters), `recovery.py`
(statement by statement, where a file does not parse), `error_patterns.py` and
`course_error_patterns.py` (common errors), `includes.py` (files within files),
`explain.py` with `explanations.txt` (each code at length).
"""
