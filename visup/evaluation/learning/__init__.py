"""Evaluation of task learning: tasks learned from runs of random missions judge runs not learned from.

Read `worlds.py` (a world as a run), then `runner.py` (`visup eval learning`).
"""
