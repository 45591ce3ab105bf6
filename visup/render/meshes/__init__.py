"""Solids of scenes, in metres.

Read `solids` (primitives and operations), then `spacecraft` (with `mesh`, which finds any solid by name),
`arm` (kinematics and links), `animals`, `distractors`.
"""
