"""The meaning of actions in terms of relations, predicates and quantities.

Read in this order: `actions.py` (the table of actions, and those of plug-ins), `vocabulary.py` (words of the
rule language as actions), `describe.py` (descriptions of actions).
"""
