"""Segmentation while the camera is static: background subtraction, blobs and their tracks.

Read `static_segmenter.py` (the loop), `camera_static.py` (whether the camera moves), `background_model.py`
(tone and variance of each pixel at rest), `blob_track.py` and `blob_tracker.py` (blobs of change, followed
by templates through merges), `templates.py` (where a template fits), `blob_filters.py` (shadows, ghosts,
limbs) and `track_fusion.py` (blobs and regions of the layers reported as one object under one id).
"""
