"""The console: recorded and running runs in a browser, with the reason for every sentence.

It reads run folders and nothing else, so it costs an agent at work only what reading its journal costs.
`library.py` finds runs, `run_view.py` reads one, `tracks.py` lays it out over time, `drawing/` draws,
`reasoning/` asks why and what if, `access.py` says who may look, `pages/` is what is seen,
`server.py` serves it.
"""
