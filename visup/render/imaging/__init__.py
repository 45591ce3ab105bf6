"""Images of scenes: ray casting, shading, background and exposure.

Read `scene_poses` (poses at a time), `renderer` (the frame loop), `raycast` (which face a ray hits),
`texture`, `background`, `sensor`.
"""
