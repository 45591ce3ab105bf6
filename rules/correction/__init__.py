"""Error-correcting parsing: the least-cost edit that brings a text into its grammar.

It is independent of the language. Read `automaton.py` (LR parsing with a stack of states), `words.py` (tokens
of a faulty text), then `search.py` (least-cost repairs).
"""
