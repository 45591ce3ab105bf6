"""Archives: many recorded runs as tables of one lake, filled on many machines and asked questions of.

Read `schema.py` (what the tables hold), `run_tables.py` (from a journal to rows), then `lake.py` (rows on
disk, a run at a time, whole or not at all), `identity.py` (what tells runs apart), `filling/` (many clips on
many workers), `asking/` (SQL) and `finding/` (conditions). Needs the extra `visup[cluster]`; nothing of it is
imported before it is used.
"""
