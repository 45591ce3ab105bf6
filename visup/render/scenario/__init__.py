"""Scenario files: objects, motion, light and ground truth of a scene.

Read `scenario` (the format), `optics` (camera, light, background), `trajectories` (poses over time),
`library` (scenarios that ship).
"""
