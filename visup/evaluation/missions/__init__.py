"""Evaluation of the whole supervisor: missions with ground truth, from video to verdict.

Read `files` (a mission on disk), `scores` and `pose_errors` (the figures, pure functions), `recorder` (what
was reported), `overlaps` (which object is which), then `runner`.
"""
