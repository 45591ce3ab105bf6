"""What a taught thing looks like.

Read `scene.py` and `pose.py` (patches of a picture), `features.py`, `colours.py`,
`correlation_filter.py`, then `thing_model.py`, which makes all of it from a taught view.
"""
