"""Traits by which objects without a model are distinguished, such as colour, size and first position.

Read in this order: `colours.py` (the meaning of colour words), `reasoner.py` (the memory of each object).
`tasks/casting/fitness.py` matches objects with a task's description of an actor.
"""
