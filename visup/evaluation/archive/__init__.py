"""`visup eval archive`: lakes that fill whatever happens, and answer fast.

Read `runner.py` (all parts together), `recorded.py` (a lake of simulated missions), `conditions.py` (random
conditions) with `exactness.py` (what is found equals what a replay says), `multiplied.py` (a large lake made
of a small one) with `large_lake.py` (how fast it answers), `kills.py`, `throughput.py` and `scheduling.py`.
"""
