"""Evaluation of segmentation and tracking on sequences with masks or boxes.

Read `mask_scores` and `mot_scores` (the figures, pure functions), `runner` (evaluates sequences), then
`rendered_clips` (rendered clips for cases missing in the shared footage, each with a bar).
"""
