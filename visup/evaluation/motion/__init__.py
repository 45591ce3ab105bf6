"""Evaluation of segmentation and tracking on sequences with masks or boxes.

Read `mask_scores` and `mot_scores` (the figures, pure functions), `runner` (walks the sequences), then
`rendered_clips` (clips rendered for what shared footage lacks, each with a bar).
"""
