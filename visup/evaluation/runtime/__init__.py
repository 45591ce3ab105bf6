"""Evaluation of a running agent: resume, speed, memory, stepping.

Read `resume` (runs that are killed), `scripted_observations`, `pace`, `soak` and `endurance` (speed and
memory), then `stepping` (what going back costs). Faults of behaviours are injected in
`tests/oracles/runtime`.
"""
