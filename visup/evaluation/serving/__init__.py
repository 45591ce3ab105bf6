"""A service rehearsed: four cameras, everything that goes wrong in a night, and an account of every alert.

Read `scene.py` (what is watched), `streams.py` (cameras that stall, drop and send garbage), `receiver.py` (a
sink that goes down), `night.py` (what goes wrong, and when), `account.py` (what was lost or told twice),
`costs.py` (what one camera takes), and `rehearsal.py`, which puts them together.
"""
