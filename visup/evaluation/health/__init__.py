"""Evaluation of the health behaviour: faults injected into sound video, and what is reported.

Read `camera_faults` (the faults and the status that each must give), then `runner` (the campaign).
"""

from visup.evaluation.health.runner import evaluate_health

__all__ = ["evaluate_health"]
