"""The index: which views of a database are worth a full comparison.

Read `view_records.py` (the byte layout of a stored view), `outline_sketch.py` (an outline in a hundred bytes)
and `view_index.py` (the three stages).
"""
