"""Coupling: which objects move as one body, and when they part.

Read in this order: `reasoner.py` (the sequential test of rest, and its conditions), `evidence.py` (the memory
of a pair), `carriers.py` (who sets out while one alone moves it), `contact.py` (contact versus passing),
`relative_motion.py` (relative motion of two outlines; its compiled loops are `_relative_motion_jit.py`).
"""

from visup.rules.coupling.reasoner import CouplingReasoner, CouplingSettings

__all__ = ["CouplingReasoner", "CouplingSettings"]
