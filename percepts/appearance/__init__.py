"""Detection and tracking of taught objects, at rest and in motion.

Read `models/` (appearance models: patch, mask, colours, correlation filter), `background/` (camera motion
and change), `tracking/` (detection, tracking, rest and occlusion, segmentation), `output/` (regions, and
which moving regions the objects explain), then `behaviour.py`.
"""
