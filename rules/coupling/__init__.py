"""Coupling: which objects move as one body, and when they part.

Read in this order: `reasoner.py` (the sequential test of rest, and its conditions), `evidence.py` (what is
remembered of a pair), `contact.py` (outlines that meet, and whether that is meant), `relative_motion.py`
(how two outlines move relative to each other; its compiled loops are `_relative_motion_jit.py`).
"""

from visup.rules.coupling.reasoner import CouplingReasoner, CouplingSettings

__all__ = ["CouplingReasoner", "CouplingSettings"]
