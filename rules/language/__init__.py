"""The language of rule files: text to checked trees.

Read in this order: `rules.lark` (the grammar), `parser.py` (text to rules, all errors at once),
`transform.py` (Lark's tree to ours), `typecheck.py` and `dimensions.py` (names, arguments, units),
`cost.py` (what a rule retains and how late its verdict comes), `rule_builder.py` (the same trees in Python);
`diagnostics.py` (errors with their places, for rules and tasks).
"""
