"""Runs: an agent wired from settings, a source watched to its end, and the folder that records the run.

Read `settings.py` (the settings of a run, with `inputs/`: zones, plug-ins, checks before the start),
`wiring.py` (an agent from it), `runner.py` (one supervised run) and `recorder.py` (its folder); then
`checkpoints.py` with `resume.py` (resuming a run that was killed), `replay.py` and
`replay_report.py` (reasoning again about a recorded run), `runtime_faults.py` (faults of the environment,
as percepts) and `operator.py` (who answers questions).
"""
