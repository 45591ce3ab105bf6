"""Formulas over signals in dense time: exact between samples, with a choice of semantics at the ends.

`rules/monitoring` judges at samples, which is what frames of a camera are. Here a signal is a row of
pieces of time, held or straight from sample to sample, and so is every formula of it.

Read in this order: `sweep.py` (pieces, and what is active as time goes by), `operators.py` (what each
operator makes of pieces), `lines.py` (signals that are straight between samples), `compiler.py`,
`monitor.py` (what users call).
"""

from visup.rules.dense_time.monitor import DenseTimeMonitor, Ends, judge_recording
from visup.rules.dense_time.sweep import Piece

__all__ = ["DenseTimeMonitor", "Ends", "Piece", "judge_recording"]
