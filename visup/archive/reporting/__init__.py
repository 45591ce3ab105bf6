"""The report page of a lake.

Read `statistics.py` (how long stages take, what drifts, how runs fail), `figures.py` and `page.py`.
"""
