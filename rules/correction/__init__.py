"""Error-correcting parsing: the least-cost edit that brings a text into its grammar.

It is independent of the language. Read `automaton.py` (LR parsing with a stack of states), `tokens.py`
(tokens of a faulty text), then `repair_search.py` (least-cost repairs).
"""
