"""Verification of one active step: observations of its action, and its status over time.

Read in this order: `observation.py` and `observe.py` (the current observation of an action), `passing.py`
(contact as opposed to passing by), `new_trends.py` (trends that have just set in), `stage_conditions.py`
(conditions of the task on the beginning, end, progress and failure of a step), `pauses.py` (working time),
`step_monitor.py` (the status of a step over time), `recovery.py` (when a failing step has recovered),
`concurrent_actions.py` (actions joined by `&`), `motion_onset.py` (motion onset), `stage_onset.py` (the onset
of a stage), `reported_relations.py` (relations that were reported), `step_model.py` (the likelihood of
observations), `settings.py` (the time constants).
"""

from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.observe import observe
from visup.tasks.verification.settings import DEFAULT_SETTINGS, TaskSettings
from visup.tasks.verification.step_monitor import StepMonitor

__all__ = ["DEFAULT_SETTINGS", "ActionObservation", "StepMonitor", "TaskSettings", "observe"]
