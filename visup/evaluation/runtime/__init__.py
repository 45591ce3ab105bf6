"""Evaluation of a running agent: faults, resume, speed, memory, stepping.

Read `behaviour_faults` with `fault_injection`, `resume` (runs that are killed), `pace` and `soak` (speed and
memory), then `stepping` (what going back costs).
"""
