"""Building model databases: from meshes, images of silhouettes, and masks of videos.

Read `database_builder.py` (the whole build), `mesh_views.py` (silhouettes rendered from meshes; needs
the extra `render`), `closed_views.py` (the same without narrow gaps) and `build_parts.py` (intermediate
files, so that an interrupted build can resume).
"""
