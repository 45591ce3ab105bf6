"""One supervised run: the agent wired from its settings, driven over a source, recorded, replayed, resumed.

Read in this order: `settings.py` (what a run is given), `wiring.py` (the agent made from it), `runner.py`
(the run from start to end), `recorder.py` (what it writes), `replay.py` and `resume.py` (what can be done
with it afterwards).
"""
