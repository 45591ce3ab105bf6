"""The index: which views of a database are worth a full comparison.

Read `view_records.py` (what is stored of a view, byte for byte), `outline_sketch.py` (an outline in a hundred
bytes) and `view_index.py` (the three sieves).
"""
