"""Error-correcting parsing: the smallest edit that brings a text into its grammar.

It is independent of the language. Read `automaton.py` (the parser as a stack of states), `words.py` (what
each word of a wrong text may be), then `search.py` (repairs of least cost).
"""
