"""The cogitation-action cycle: perceive, update, cogitate, match, attend, act.

Read `agent.py` (the cycle on one screen), `outcomes.py` (conclusions of reasoners are merged),
`alerts.py` (alerts open and close), `answers.py` (what the operator says becomes a fact) and
`own_troubles.py` (which alerts are about visup itself).
"""

from visup.agent.cycle.agent import Agent, Reasoners

__all__ = ["Agent", "Reasoners"]
