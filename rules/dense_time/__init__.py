"""Dense-time monitoring: exact between samples, with a choice of semantics at the ends.

`rules/monitoring` evaluates at samples, such as frames of a camera. Here a signal is a sequence of pieces of
time, piecewise constant or linear between samples, and so is every formula over it.
 Read in this order: `sweep.py` (pieces, and a sweep over active ones), `operators.py` (operators on pieces),
`lines.py` (piecewise linear signals), `compiler.py`, `monitor.py` (the public interface).
"""

from visup.rules.dense_time.monitor import DenseTimeMonitor, Ends, judge_recording
from visup.rules.dense_time.sweep import Piece

__all__ = ["DenseTimeMonitor", "Ends", "Piece", "judge_recording"]
