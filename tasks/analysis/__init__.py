"""Analysis of tasks: a task judged on recorded runs, what runs exercise of it, how two tasks differ.

`judging.py` (a task on a run, offline), `coverage.py` (stages that runs have executed), `languages.py` (the
difference of two tasks by what they accept, not by their text).
"""
