"""Segmentation while the camera is static: background subtraction, blobs and their tracks.

Read `static_segmenter.py` (the loop), `camera_static.py` (whether the camera moves), `background_model.py`
(tone and variance of each background pixel), `blob_track.py` and `blob_tracker.py` (foreground blobs, tracked
by templates through merges), `templates.py` (template matching), `bodies.py` (people side by side in one
blob), `blob_filters.py` (shadows, ghosts, limbs), `slow_parts.py` (what hardly moves of a body that
the layers show in part) and `track_fusion.py` (blobs and layer regions reported as one object under one id).
"""
