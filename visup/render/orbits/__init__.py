"""Random missions in orbit: an arm, a satellite, sometimes an unexpected object, and an outcome.

Read `courses` (the events), then `scenes` (camera and light), then `random_orbit` (draws a mission).
"""
