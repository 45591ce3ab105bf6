"""Segmentation while the camera is static: background subtraction, blobs and their tracks.

Read `static_segmenter.py` (the loop), `camera_static.py` (whether the camera moves), `background_model.py`
(tone and variance of each background pixel), `blob_track.py` and `blob_tracker.py` (foreground blobs, tracked
by templates through merges), `templates.py` (template matching), `side_by_side.py` (people side by side in
one blob), `blob_filters.py` (shadows, ghosts, limbs), `slow_motion.py` (nearly motionless parts of a body
whose other parts the layers show) and `track_fusion.py` (blobs and layer regions reported as one object under
one id). A *ghost* is the foreground where an object of the background model has left; *ground* is the scene
behind the objects.
"""
