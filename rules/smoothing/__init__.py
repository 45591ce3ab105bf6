"""States and quantities that do not flicker: changes must last, first glances do not decide.

Read in this order: `hysteresis.py` (a qualitative state changes only when the change has lasted),
`ema.py` (exponential means of what states are read off).
"""
