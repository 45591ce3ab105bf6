"""Random missions in orbit: an arm, a satellite, sometimes a stranger, and what comes of it.

Read `courses` (what happens), then `scenes` (what it is filmed with), then `random_orbit` (draws one).
"""
