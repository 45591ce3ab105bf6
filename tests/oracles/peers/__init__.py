"""Cases of other tools' own tests: formulas of temporal logics, relations of qualitative calculi.

The data stand outside the checkout (`../shared/data/peers`), and are data only. Read in this order:
`translation.py` (a peer's formula in our language), `temporal.py`, `qualitative.py`, `runner.py`.
"""
