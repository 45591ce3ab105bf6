"""Questions in visup's own language: where in a lake a condition was true.

Read `pattern.py` (what is looked for), `possible.py` (which runs can have it, by the intervals of relations),
`judge.py` (a condition judged step by step), `beliefs.py` (what of a run suffices for most) and `search.py`
(the others reasoned about again, which gives what an agent would have said); `task_search.py` asks where a
task was carried out, `clips.py` cuts hits out of the footage.
"""
