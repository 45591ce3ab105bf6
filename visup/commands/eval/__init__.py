"""`visup eval`: figures against ground truth, as tables and as JSON.

Read `catalogue.py` (one row for each evaluation), then `evaluation.py` (how a row becomes a command and is
run), `tables.py` (how figures are drawn) and `adapters.py` (evaluations that need more than to be called).
"""
