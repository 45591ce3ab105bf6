"""What a run is given besides its source: zones, behaviours of the user's own, and whether all of it will do.

Read `zones.py` and `plugins.py` (what is loaded), `presets.py` (what suits a kind of scene),
`preflight.py` (what is known before the first frame) and `speed.py` (what a run takes of this machine);
`run_sinks.py` is where alerts go, `stop_signals.py` how one stops it.
"""
