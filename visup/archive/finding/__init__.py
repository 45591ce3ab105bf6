"""Search in the rule language: where in a lake a condition was true.

Read `pattern.py` (the condition), `possible.py` (prefilters runs by the intervals of relations),
`pattern_evaluator.py` (evaluates a condition step by step), `beliefs.py` (saved beliefs that suffice for
most conditions) and `search.py` (replays the reasoning of the other runs); `task_search.py` finds where a
task was carried out, `clips.py` cuts hits out of the footage.
"""
