"""Compaction: the files of many runs joined, so that a query over 100,000 runs opens a few hundred files.

Read `manifest.py` (the partitions of a lake: one file, replaced atomically), `partition.py` (the content of
one, with its index) and `compacting.py` (joins runs into partitions and deletes what they replace).
"""
