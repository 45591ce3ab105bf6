"""Damaged and hostile input of every kind, for `visup eval hardening` and `make fuzz`.

Read `mutations.py` (how a file is damaged), `subjects.py` (the kinds, and what reads each), `fuzzing.py`
(a process that reads them within limits) and `runner.py` (the evaluation, with races of writers).
"""
