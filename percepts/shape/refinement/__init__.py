"""Poses made exact: a model's own mesh, drawn as it should look and held against the picture.

A silhouette matched against views tells an orientation to some ten degrees, and an object with a plane
of symmetry looks the same from two directions. What is inside the outline tells them apart.

Read in this order: `mesh_model.py` (what is kept of a mesh), `region_picture.py` (what is seen),
`pose_fit.py` (the search), `_pose_fit_jit.py` (its compiled loops).
"""
