"""Evaluation of a running agent: resume, speed, memory, stepping.

Read `resume` (killed runs), `scripted_observations`, `pace`, `soak` and `endurance` (speed and
memory), then `stepping` (cost of stepping back). Faults of behaviours are injected in
`tests/oracles/runtime`.
"""
