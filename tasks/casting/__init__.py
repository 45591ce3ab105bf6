"""Casting: the assignment of objects to the actors of a task.

Read in this order: `fitness.py` (how well an object fits the description of an actor), `matching.py` (the
best matching of actors and objects).
"""
