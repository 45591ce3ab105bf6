"""Runs: an agent wired from settings, a source watched to its end, and the folder that records it.

Read `settings.py` (what a run is given, with `inputs/`: zones, plug-ins, what is known beforehand),
`wiring.py` (an agent from it), `runner.py` (one supervised run) and `recorder.py` (its folder); then
`checkpoints.py` with `resume.py` (going on with a run that was killed), `replay.py` and
`replay_report.py` (reasoning again about a recorded run), `runtime_faults.py` (faults of the surroundings
as percepts) and `operator.py` (who answers questions).
"""
