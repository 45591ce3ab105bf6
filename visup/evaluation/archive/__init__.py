"""`visup eval archive`: robustness and speed of lakes.

Read `runner.py` (all parts), `simulated_lake.py` (a lake of simulated missions), `conditions.py` (random
conditions) with `exactness.py` (search results equal a replay), `synthetic_lake.py` (a large lake made of a
small one) with `large_lake.py` (its query times), `kills.py`, `throughput.py` and `scheduling.py`.
"""
