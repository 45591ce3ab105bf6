"""Error-correcting parsing: the least changes of words that bring a text into its grammar.

It knows grammars, and no language. Read `automaton.py` (the parser as a stack of states), `words.py` (what
each word of a wrong text may be), then `search.py` (repairs of least cost).
"""
