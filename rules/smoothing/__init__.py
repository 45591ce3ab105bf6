"""Smoothing of states and quantities: hysteresis in time, and exponential moving averages.

Read in this order: `hysteresis.py` (a qualitative state changes only when the change has lasted), `ema.py`
(exponential moving averages of the underlying quantities).
"""
