"""The files of many runs joined, so that a question to a hundred thousand runs opens a few hundred files.

Read `manifest.py` (which partitions a lake has: one file, replaced whole), `partition.py` (what is in one,
with its index) and `compacting.py` (runs into partitions, and what they replace taken away).
"""
