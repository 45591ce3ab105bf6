"""Safety rules at work: verdicts for all choices of objects, alarm conditions, explanations.

Read in this order: `safety.rules` (the rules that ship), `compiled_rules.py` (rules made ready to
run), `verdicts.py` (their values in one step), `alarm_condition.py` (conditions raised, updated,
resolved), `reasoner.py` (the reasoner that joins these); then `explain.py` and `queries.py` (why a
rule is true or not) and `expression.py` (expressions watched from outside).
"""
