"""Diagnostics of task files: each error has a stable code, a position, and a hint.

Read in this order: `codes.py` (every code), `normalise.py` (characters), `recovery.py`
(statement by statement if a file does not parse), `error_patterns.py` and
`course_error_patterns.py` (common errors), `includes.py` (included files),
`explain.py` with `explanations.txt` (explanations of codes).
"""
