"""Random missions in orbit: an arm, a satellite, sometimes an unexpected object, and an outcome.

Read `capture_scripts` (the events), `unexpected_objects`, then `random_orbit` (draws a mission).
"""
