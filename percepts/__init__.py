"""Perception: from frames to percepts, causally, one frame after the other.

Read in this order:

1. `video/`: where frames come from (files, folders of images, cameras, streams).
2. `health/`: whether the image can be trusted at all.
3. `motion/`: motion segmentation: regions with a mask, a velocity and an id (paper, section 3).
4. `shape/`: recognition of regions by their silhouettes, matched against known models (section 4).
5. `depth.py`: the distance of a region, from its size and that of its model (section 7.4).
6. `taught/`: objects taught by a user, as they are stored.
7. `appearance/`: detection and tracking of taught objects, at rest and in motion.

`health`, `motion`, `shape`, `depth` and `appearance` are behaviours: each takes a frame and what was
reported of it before, and reports percepts. None of them knows another but by percepts; but `depth` also
reads the model database, and `appearance` runs `motion` within it, in whose place it stands.
"""
