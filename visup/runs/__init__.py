"""Runs: an agent wired from settings, a source watched to its end, and the folder that records the run.

Read `settings.py` (the settings of a run, with `inputs/`: zones, plug-ins, checks before the start),
`wiring.py` (builds the agent), `runner.py` (one supervised run) and `recorder.py` (its folder); then
`checkpoints.py` with `resume.py` (resuming a killed run), `replay.py` and `replay_report.py` (replaying the
reasoning of a recorded run), `runtime_faults.py` (faults of the environment as percepts) and `operator.py`
(answers to questions).
"""
