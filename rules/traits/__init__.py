"""Traits by which objects without a model are distinguished, such as colour, size and first position.

Read in this order: `colours.py` (what the words for colours mean), `reasoner.py` (what is remembered of
each object). `tasks/casting/fitness.py` asks whether an object meets what a task says of an actor.
"""
