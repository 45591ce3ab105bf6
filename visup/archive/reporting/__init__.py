"""What a lake tells as a whole, on one page.

Read `statistics.py` (how long stages take, what drifts, how runs fail), `figures.py` and `page.py`.
"""
