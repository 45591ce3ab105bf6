"""Percepts simulated from the ground truth of missions, with the errors that real percepts have.

Read `truth_masks` (masks with noisy outlines), `view_noise` and `hypotheses` (names, views, depth), then
`percepts` (the behaviours that report all that).
"""
