"""Support for unattended runs of months.

Consecutive runs (`next_run.py`), quiet hours for alerts that can wait (`quiet_hours.py`), and the time spent
in each phase (`phase_meter.py`).
"""
