"""The cogitation-action cycle: perceive, update, cogitate, match, attend, act.

Read `agent.py` (the cycle on one screen), `outcomes.py` (merging the conclusions of reasoners),
`alerts.py` (opening and closing alerts), `answers.py` (the operator's answers become facts) and
`system_alerts.py` (alerts about visup itself).
"""

from visup.agent.cycle.agent import Agent, Reasoners

__all__ = ["Agent", "Reasoners"]
