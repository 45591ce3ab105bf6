"""What a user has shown once: outlines drawn in one picture, as they are kept.

Read `view.py`; `drawing.py` shows views to people. The model database stores these views beside those of
meshes and silhouettes.
"""
