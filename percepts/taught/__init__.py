"""Objects taught by a user: outlines drawn in one image, in their stored form.

Read `taught_view.py`; `drawing_views.py` draws views. The model database stores these views beside those of
meshes and silhouettes.
"""
