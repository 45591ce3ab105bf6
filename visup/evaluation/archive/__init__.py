"""`visup eval archive`: robustness and speed of lakes.

Read `runner.py` (all parts), `recorded.py` (a lake of simulated missions), `conditions.py` (random
conditions) with `exactness.py` (search results equal a replay), `multiplied.py` (a large lake made of a small
one) with `large_lake.py` (its query times), `kills.py`, `throughput.py` and `scheduling.py`.
"""
