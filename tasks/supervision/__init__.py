"""The supervision of tasks: a reasoner that determines the state of each task.

Read in this order: `supervise.py` (the reasoner), `snapshot.py` (the current observation), `hypotheses.py`
(the hypotheses), `monitored_phases.py` with `open_transitions.py` and `advance.py` (the model of the task
filter), `belief.py` (marginals, verdict), `stage_beginnings.py` (which stages have begun),
`task_inference.py` (which of several tasks is in progress), `invariants.py`, `events.py` and `sentences.py`
(reports), `memory.py` (state).
"""

from visup.tasks.supervision.memory import TaskMemory
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.supervise import finish, task_reasoner

__all__ = ["MonitoredPhases", "TaskMemory", "finish", "task_reasoner"]
