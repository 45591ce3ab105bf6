"""The rule language: from text to type-checked syntax trees.

Read in this order: `rules.lark` (the grammar), `parser.py` (text to rules, all errors at once),
`transform.py` (Lark's tree to AST), `typecheck.py`, `calls.py` and `dimensions.py` (names,
arguments, units), `rule_builder.py` (the same trees built in Python); `diagnostics.py` (errors
with locations, for rules and tasks).
"""
