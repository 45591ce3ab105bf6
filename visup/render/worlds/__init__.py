"""Random worlds: machines at work in scenes that are drawn from a seed, with masks, brief and truth.

Read `world.py` (the data of a world), `kinds/` (the scripts; `pick.py` first), `assets/` (surroundings and
machines), `plate.py` (the static scene, rendered once), `world_renderer.py` (moving bodies, rendered in each
frame), `truth.py`, `teaching_clip.py` and `writer.py` (the files).
"""
