"""The supervision of tasks: a reasoner that determines the state of each task.

Read in this order: `supervise.py` (the reasoner), `snapshot.py` (the current observation), `hypotheses.py`
(the hypotheses that are followed), `monitored_phases.py` with `open_transitions.py` and `advance.py` (the
model of the task filter), `belief.py` (marginals, verdict), `beginning.py` (what has begun),
`task_inference.py` (which of several tasks is going on), `invariants.py`, `events.py` and
`sentences.py` (what is reported), `memory.py` (what is remembered).
"""

from visup.tasks.supervision.memory import TaskMemory
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.supervise import finish, task_reasoner

__all__ = ["MonitoredPhases", "TaskMemory", "finish", "task_reasoner"]
