"""What may be plugged into an agent, and what an agent promises it.

Read `contract.py` (what a behaviour declares), `behaviour.py` (the protocols of behaviours and
reasoners), `limits.py` (the limits of time and memory that behaviours are held to), `phases.py` (the
phases of a step) and `saving.py` (behaviours whose state can be saved).
"""

from visup.agent.contract.behaviour import Behaviour, Outcome, Reasoner
from visup.agent.contract.contract import Contract
from visup.agent.contract.limits import Limits
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.contract.saving import Saveable, Stateless

__all__ = [
    "AgentSnapshot",
    "Behaviour",
    "Contract",
    "Limits",
    "Outcome",
    "Phase",
    "Reasoner",
    "Saveable",
    "Stateless",
]
