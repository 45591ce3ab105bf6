"""Scenario rendering: from a scenario file to a video with masks and ground truth.

Folders, in reading order:

- `scenario`: the format of scenario files, trajectories, camera and light, the shipped scenarios.
- `meshes`: the solids in scenes: spacecraft, an arm, animals, machines, distractors.
- `imaging`: the renderer: ray casting over a background through a sensor.
- `output`: ground truth, mission folders, the demo clip and its model database.
- `orbits`: random missions in orbit.
- `worlds`: random worlds of machines at work, with a renderer of their own.

Needs the extra ``visup[render]``; nothing here is imported by ``import visup``.
"""
