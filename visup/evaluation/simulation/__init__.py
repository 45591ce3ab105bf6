"""Percepts simulated from the ground truth of missions, with realistic errors.

Read `truth_masks` (masks with noisy outlines), `view_noise` and `hypotheses` (names, views, depth), then
`percepts` (the behaviours that report them).
"""
