"""The terminal: display of records, the narrative of a run, and the session of `visup step`.

Read `narrator.py` (events as lines), `tables.py` and `display.py` (records as tables and trees), then
`session_commands.py`, `session_views.py`, `session.py` and `prompt.py` (the interactive session).
"""
