"""Safety rules: verdicts for all bindings of objects, alarm conditions, explanations.

Read in this order: `safety.rules` (the rules that ship), `compiled_rules.py` (compiled rules), `verdicts.py`
(their values in one step), `alarm_condition.py` (conditions raised, updated, resolved), `reasoner.py` (the
reasoner that combines these); then `explain.py` and `queries.py` (why a rule is true or not) and
`expression.py` (watch expressions).
"""
