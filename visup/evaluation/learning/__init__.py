"""Learning tasks, measured: random missions are watched, a task is learned, others are judged by it.

Read `worlds.py` (a world as a run), then `runner.py` (`visup eval learning`).
"""
