"""Detection and tracking of taught objects, at rest and in motion.

Read `looks/` (appearance models: patch, mask, colours, correlation filter), `tracking/` (detection, tracking,
rest and occlusion, segmentation), `output/` (regions, and which moving regions the objects explain), then
`behaviour.py`.
"""
