"""Appearance models of taught objects.

Read `scene.py` and `pose.py` (the reduced frame, and patches cut out of it), `features.py`, `colours.py`,
`correlation_filter.py`, then `thing_model.py`, which builds the model of a taught view. In the names of this
room, a *thing* is a taught object, `looks` its current `Appearance`, and `it` the `Appearance` searched for.
"""
