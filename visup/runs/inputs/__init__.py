"""What a run is given besides its source: zones, behaviours of the user's own, and whether all of it will do.

Read `zones.py` and `plugins.py` (what is loaded), `presets.py` (what suits a kind of scene),
`preflight.py` (what is known before the first frame) and `speed.py` (what a run takes of this machine);
`run_folder.py` is where it is recorded, `run_sinks.py` where alerts go, `audience.py` who follows it,
`stop_signals.py` how one stops it.
"""
