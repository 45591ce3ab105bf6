"""Images from scenes: rays are cast from the camera, shaded, put before a background and exposed.

Read `scene_poses` (where everything is at a time), `renderer` (the frame loop), `raycast` (which face a ray
meets), `texture`, `background`, `sensor`.
"""
