"""Support for unattended runs of months.

One run follows the other (`next_run.py`), nobody is woken at night for what can wait (`quiet_hours.py`), and
it is known what its time is spent on (`phase_meter.py`).
"""
