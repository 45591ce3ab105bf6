"""Tools around task files: none of them takes part in supervision.

`formatter.py` lays a file out, `diagram.py` and `outline.py` draw a task, `simulate.py` lists the runs
that it allows, `editing.py` answers an editor (hover, definition, completion).
"""
