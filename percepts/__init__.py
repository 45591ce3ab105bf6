"""Perception: from frames to percepts, causally, one frame at a time.

Read in this order:

1. `video/`: where frames come from (files, folders of images, cameras, streams).
2. `health/`: whether the image can be trusted at all.
3. `motion/`: motion segmentation into regions with a mask, a velocity and an id (paper, section 3).
4. `shape/`: recognition of regions by their silhouettes, matched against known models (section 4).
5. `depth.py`: the distance of a region, from its apparent size and its model's (section 7.4).
6. `taught/`: records of objects taught by a user.
7. `appearance/`: detection and tracking of taught objects, at rest and in motion.

`health`, `motion`, `shape`, `depth` and `appearance` are behaviours: each takes a frame and the percepts
reported for it so far, and reports its own. They communicate through percepts only, with two exceptions:
`depth` reads the model database, and `appearance` wraps and replaces `motion`.
"""
