"""Evaluation of the health behaviour: faults injected into good video.

Read `camera_faults` (the faults and their expected statuses), then `runner` (the campaign).
"""

from visup.evaluation.health.runner import evaluate_health

__all__ = ["evaluate_health"]
