"""The records that flow through a step, and the mental model that they change.

Read `records.py` (frames, percepts, observations) and `events.py` (events, alerts, directives), then
`object_beliefs.py`, `task_beliefs.py` and `mind.py` (all that is believed), `memory.py` (what reasoners
remember) and `step.py` (all of one step). `relation_table.py` on `relation_columns.py` holds the
relations between objects by columns; `orientation.py` is the convention of view directions; `errors.py`
is the tree of errors. `fast_replace.py` copies records quickly, `display.py` lets them show themselves in
notebooks.
"""
