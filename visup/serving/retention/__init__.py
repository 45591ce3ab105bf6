"""Disk space and retention: how long recordings are kept, and what is deleted first when the disk is full.

Read `stored_files.py` (the content of a store), `removals.py` (what to delete, a pure function) and
`housekeeper.py` (deletes it).
"""
