"""Trackers of others on the boxes and the video that visup is given: ByteTrack, and MOG2 blobs with SORT.

They are installed by hand (`pip install "supervision<0.27" trackers`); nothing that ships imports them.
"""
