"""Rehearsal of a service: four cameras, injected faults, and an account of every alert.

Read `scene.py` (the scene), `streams.py` (cameras that stall, drop and send garbage), `receiver.py` (a sink
that goes down), `fault_injection.py` (the faults and their timetable), `alert_audit.py` (lost and duplicate
alerts), `costs.py` (load of one camera), and `rehearsal.py`, which combines them.
"""
