"""Evaluation of the whole supervisor: missions with ground truth, from video to verdict.

Read `files` (a mission on disk), `scores` (the figures, pure functions), `pose_errors`, then `runner`.
"""
