"""Inputs of a run besides its source: zones, user behaviours, and the preflight.

Read `zones.py` and `plugins.py` (what is loaded), `presets.py` (settings for kinds of scenes), `preflight.py`
(checks before the first frame) and `speed.py` (the load of a run); `run_folder.py` creates its folder,
`run_sinks.py` opens sinks for alerts, `audience.py` has its observers, `stop_signals.py` stops it.
"""
