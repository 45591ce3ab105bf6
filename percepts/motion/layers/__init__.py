"""Layers of motion: parametric motions fitted to constraints by robust EM.

Read `affine.py` (the motion model and its fits), `dominant_motion.py` (the most widespread motion, by random
samples), `background_motion.py` (the few motions that make up the background), `layer_discovery.py` (new
layers among constraints that none explains), `affine_rate.py` (a motion per second), `camera_sway.py`
(whether a camera shakes in place) and `dense_labelling.py` (the posterior of each superpixel over the
labels).
"""
