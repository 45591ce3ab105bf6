"""Evaluation of the whole supervisor: missions with ground truth, from video to verdict.

Read `files` (a mission on disk), `scores` and `pose_errors` (the figures, pure functions), `recorder` (the
reports), `overlaps` (correspondence of objects), then `runner`.
"""
