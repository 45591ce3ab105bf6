"""Tools for task files, not used in supervision.

`formatter.py` formats a file, `diagram.py` and `outline.py` draw a task, `simulate.py` enumerates its
courses, `editing.py` supports editors (hover, definition, completion).
"""
