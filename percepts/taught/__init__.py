"""Objects taught by a user: outlines drawn in one picture, in their stored form.

Read `view.py`; `drawing.py` draws views. The model database stores these views beside those of
meshes and silhouettes.
"""
