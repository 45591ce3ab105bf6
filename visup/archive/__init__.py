"""Archives: many recorded runs as the tables of one lake, filled on many machines, and queried.

Read `schema.py` (what the tables hold), `run_tables.py` (from a journal to rows), then `lake.py` (rows on
disk, one run at a time, atomically), `identity.py` (keys of runs), `filling/` (many clips on
many workers), `querying/` (SQL) and `finding/` (conditions). Needs the extra `visup[cluster]`, which is
imported only when it is used.
"""
