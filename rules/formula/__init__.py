"""Abstract syntax trees of the formulas of rules and tasks: terms, conditions, units.

Read in this order: `units.py` (numbers with units, dimensions), `terms.py` (quantities and
arithmetic), `nodes.py` (conditions, temporal operators, quantifiers, rules), `rebuilding.py` (tree
rewriting). Every node is frozen and prints itself back as the source it was parsed from.
"""
