"""Coupling: which objects are rigidly connected, and when they separate.

Read in this order: `reasoner.py` (the sequential test of relative rest, and the conditions of coupling and
decoupling), `evidence.py` (the memory of a pair), `carriers.py` (which body carries one that starts to move),
`contact.py` (contact as opposed to passing by), `relative_motion.py` (relative motion of two outlines; its
compiled loops are in `_relative_motion_jit.py`).
"""

from visup.rules.coupling.reasoner import CouplingReasoner, CouplingSettings

__all__ = ["CouplingReasoner", "CouplingSettings"]
