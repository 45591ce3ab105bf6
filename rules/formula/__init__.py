"""The formulas of rules and tasks as frozen trees: terms, conditions, units.

Read in this order: `units.py` (numbers with units, dimensions), `terms.py` (quantities and
arithmetic), `nodes.py` (conditions, temporal operators, quantifiers, rules), `rebuilding.py` (the same tree
with nodes changed). Every node prints itself back as the source it was parsed from.
"""
