"""Evaluation of alarms: sound footage watched without a task, and what is raised all the same.

Read `runner`.
"""

from visup.evaluation.alarms.runner import evaluate_alarms

__all__ = ["evaluate_alarms"]
