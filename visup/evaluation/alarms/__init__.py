"""Evaluation of false alarms: normal footage watched without a task.

Read `runner`.
"""

from visup.evaluation.alarms.runner import evaluate_alarms

__all__ = ["evaluate_alarms"]
