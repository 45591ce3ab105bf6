"""What each action of a task means in terms of relations, predicates and quantities.

Read in this order: `actions.py` (the table of actions, and those of plug-ins), `vocabulary.py` (the
words of rules as actions: the seam between the two languages), `describe.py` (actions in words).
"""
