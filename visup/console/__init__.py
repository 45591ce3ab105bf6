"""The console: recorded and live runs in a browser, with the reason for every statement.

It only reads run folders, so a running agent is affected no more than by any reader of its journal.
`library.py` finds runs, `run_view.py` reads one, `tracks.py` lays it out over time, `drawing/` draws,
`reasoning/` answers why and what if, `access.py` controls access, `pages/` is the user interface,
`server.py` serves it.
"""
