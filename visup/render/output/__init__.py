"""Outputs of rendering: mission folders with ground truth, the demo clip and its model database.

Read `truth` (ground truth of a frame and of a mission), `writer` (a mission),
`clip_folder` (its video, masks and files), `demo_clip`, `demo_models`.
"""
