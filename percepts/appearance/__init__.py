"""Taught objects: detected in the image, and tracked at rest and in motion.

Read `looks/` (what a thing looks like: patch, mask, colours, correlation filter), `tracking/` (finding
it, following it, telling rest from motion and from being covered, which pixels are whose), `output/`
(regions, and which moving regions the things explain), then `behaviour.py`.
"""
