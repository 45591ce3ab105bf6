"""Appearance models of taught objects.

Read `scene.py` and `pose.py` (patches of a picture), `features.py`, `colours.py`, `correlation_filter.py`,
then `thing_model.py`, which builds the model of a taught view.
"""
