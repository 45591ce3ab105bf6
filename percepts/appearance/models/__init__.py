"""Appearance models of taught objects.

Read `scene.py` and `pose.py` (the reduced frame, and patches cut out of it), `features.py`, `colours.py`,
`correlation_filter.py`, then `appearance_model.py`, which builds the model of a taught view.
"""
