"""Lakes in stores (`s3://...`, all that fsspec reads and writes): a copy here, and what differs brought over.

Read `lake_store.py` (a run comes into the store whole or not at all), then `places.py` (what a command
calls a lake).
"""
