"""Perception: from frames to percepts, causally, one frame after the other.

Read in this order:

1. `video/`: where frames come from (files, folders of images, cameras, streams).
2. `health/`: whether the image can be trusted at all.
3. `motion/`: what moves by itself: regions with a mask, a velocity and an id (paper, section 3).
4. `shape/`: what a region looks like: its silhouette matched against known models (section 4).
5. `depth.py`: how far away a region is, from its size and its model's (section 7.4).
6. `taught/`: things that a user has shown once, as they are kept.
7. `appearance/`: these things, found and followed, at rest and in motion.

`health`, `motion`, `shape`, `depth` and `appearance` are behaviours: each takes a frame and what was
reported of it before, and reports percepts. None of them knows another but by percepts; but `depth` also
reads the model database, and `appearance` runs `motion` within it, in whose place it stands.
"""
