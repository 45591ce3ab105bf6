"""The kinds of machines at work: each a function from a random generator and an outcome to a world.

Read `pick.py` first. `KINDS` in `catalogue.py` lists all of them, with their outcomes.
"""
