"""Behaviours run on a frame, each contained: whatever one does, the others and the mind go on.

Read `pipeline.py` (all behaviours of a step, in order), `behaviour_slot.py` (one of them: its turn, its
failures, its suspensions), `validation.py` (percepts that make no sense are refused), `runners.py` (in
this thread or in one that can be given up) and `process_runner.py` with its other end `worker.py` (in a
process of its own).
"""

from visup.agent.execution.behaviour_slot import BehaviourSlot
from visup.agent.execution.pipeline import ordered_slots, perceive

__all__ = ["BehaviourSlot", "ordered_slots", "perceive"]
