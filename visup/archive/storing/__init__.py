"""Lakes in object stores (`s3://...`, anything that fsspec supports), synchronised with a local copy.

Read `lake_store.py` (transfers each run atomically), then `places.py` (how commands name a lake).
"""
