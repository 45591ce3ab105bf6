"""`visup eval`: figures against ground truth, as tables and as JSON.

Read `catalogue.py` (the tables, `scene_evaluations.py` and `machinery_evaluations.py`), then `evaluation.py`
(how a row becomes a command and is
run), `tables.py` (how figures are drawn) and `adapters.py` (evaluations that need more than to be called).
"""
