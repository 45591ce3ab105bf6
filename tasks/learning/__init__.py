"""Tasks learned from runs: what happened in good ones, in what order, how long, and what never did.

Actions become strings of symbols; from these a grammar is induced by minimum description length (Lee,
Kim and Demiris, "Learning action symbols for hierarchical grammar induction", 2012), with the order
that all runs share kept and every other order left free, as task graphs do.

Read in this order: `traces.py` (a run as happenings), `meetings.py` (who meets whom, and who only comes
along), `relevance.py` (the row of events of each run), `alignment.py` (which of several is meant), `order.py`
(loops and order), `periods.py` (loops that keep a rhythm), `rests.py` (who must not be pushed),
`induction.py` (the task file), `judging.py` (a task on a run), `fitting.py`, `coverage.py`, `languages.py`.
"""
