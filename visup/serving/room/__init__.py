"""Room for what is recorded: what is kept for how long, and what goes first where the disk is full.

Read `stored.py` (what there is), `retention.py` (what goes, a pure function), `housekeeper.py` (who sees to
it).
"""
