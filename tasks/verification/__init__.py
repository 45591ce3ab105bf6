"""The verification of one step under way: what is seen of it, and how it stands.

Read in this order: `observe.py` (what is seen of an action now), `stage_conditions.py` (what the task
itself says of the beginning, end, progress and failure of a step), `step_monitor.py` (the status of a
step over time), `told.py` (what was told of the actors, and until when), `step_model.py` (how well what is
seen fits it), `settings.py` (how patient all this is).
"""

from visup.tasks.verification.observe import ActionObservation, observe
from visup.tasks.verification.settings import DEFAULT_SETTINGS, TaskSettings
from visup.tasks.verification.step_monitor import StepMonitor

__all__ = ["DEFAULT_SETTINGS", "ActionObservation", "StepMonitor", "TaskSettings", "observe"]
