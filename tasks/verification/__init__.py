"""The verification of one active step: what is observed of it, and its status.

Read in this order: `observe.py` (the current observation of an action), `stage_conditions.py` (what the task
itself says of the beginning, end, progress and failure of a step), `step_monitor.py` (the status of a
step over time), `setting_out.py` (who begins to move), `reported.py` (relations of actors as reported),
`step_model.py` (how well the observations fit it), `settings.py` (the time constants).
"""

from visup.tasks.verification.observe import ActionObservation, observe
from visup.tasks.verification.settings import DEFAULT_SETTINGS, TaskSettings
from visup.tasks.verification.step_monitor import StepMonitor

__all__ = ["DEFAULT_SETTINGS", "ActionObservation", "StepMonitor", "TaskSettings", "observe"]
