"""Pose refinement: a model's mesh is rendered and fitted to the image.

A silhouette matched against views gives an orientation to some ten degrees, and an object with a plane of
symmetry looks the same from two directions, which only the inside of the outline distinguishes. Read in this
order: `mesh_model.py` (the stored mesh), `region_image.py` (the observed region), `pose_fit.py` (the
search), `_pose_fit_jit.py` (its compiled loops), `surface_motion.py` (the rotation since a search, from
points on the surface), `pose_refiner.py` (when which of them is used).
"""
