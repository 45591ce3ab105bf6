"""Grammar induction: tasks learned from recorded runs, good and bad.

Actions become strings of symbols, from which a grammar is induced by minimum description length (Lee,
Kim and Demiris, "Learning action symbols for hierarchical grammar induction", 2012). The order common to
all runs is preserved and any other order left free, as in a task graph.

Read in this order: `traces.py` (a run as intervals), `meetings.py` (contacts, without those of carried
objects), `relevance.py` (the event sequence of each run), `carrying.py` (carrying and its destination),
`alignment.py` (removal of repeated events), `order.py` (loops and partial order), `periods.py` (periodic
loops), `places.py` and `rests.py` (final places, staying near without contact, actors at rest),
`drafts.py` (a task and its text), `induction.py` (the task file), `fitting.py` (durations of an existing
task).
"""
