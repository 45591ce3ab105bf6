"""`visup eval`: figures against ground truth, as tables and as JSON.

Read `catalogue.py` (the lists in `scene_evaluations.py` and `machinery_evaluations.py`), then `evaluation.py`
(how an entry becomes a command and runs), `tables.py` (how figures are printed) and `adapters.py`
(evaluations that need more than a call).
"""
