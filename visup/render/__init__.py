"""Scenario rendering: from a scenario file to a video with masks and ground truth.

Rooms, in reading order:

- `scenario`: the format of scenario files, trajectories, camera and light, the shipped scenarios.
- `meshes`: the solids in scenes: spacecraft, an arm, animals, distractors.
- `imaging`: the renderer: ray casting over a background through a sensor.
- `output`: ground truth, mission folders, the demo clip and its model database.

Needs the extra ``visup[render]``; nothing here is imported by ``import visup``.
"""
