"""Execution of behaviours on a frame, with fault containment: a fault in one affects no other.

Read `pipeline.py` (all behaviours of a step, in order), `behaviour_slot.py` (one behaviour: scheduling,
failures, suspensions), `validation.py` (checking of percepts), `runners.py` (in
this thread, or in one that can be abandoned) and `process_runner.py` with its counterpart `worker.py` (in a
separate process).
"""

from visup.agent.execution.behaviour_slot import BehaviourSlot
from visup.agent.execution.pipeline import ordered_slots, perceive

__all__ = ["BehaviourSlot", "ordered_slots", "perceive"]
