"""Objects taught by a user: outlines drawn in one picture, as they are stored.

Read `view.py`; `drawing.py` shows views to people. The model database stores these views beside those of
meshes and silhouettes.
"""
