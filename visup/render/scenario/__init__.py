"""Scenario files: what is in the scene, how it moves, how it is lit, and what is true of it.

Read `scenario` (the format), `optics` (camera, light, background), `trajectories` (poses over time),
`library` (scenarios that ship).
"""
