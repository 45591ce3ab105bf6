"""Stepping: a debugger for agents, with stepping back, breakpoints, what-if branches and explanations.

>>> from visup.evaluation.runtime.scripted_observations import moving_ellipses
>>> from visup.runs.settings import WatchSettings
>>> from visup.stepping import ScriptedObservations, Stepper
>>> from visup.runs.wiring import reasoning_agent
>>> stepper = Stepper(reasoning_agent(WatchSettings("script")), ScriptedObservations(moving_ellipses(100)))
>>> stepper.step(until="entry").reasons
('entry: Object 1 is in view.',)
>>> stepper.back(3).frame_index
6

Read in this order: `history.py` (access to all steps), `breakpoints.py` (where to stop), `stepper.py`
(the debugger), `diff.py` (differences of minds), `what_if.py` (branches), and `explanations/` (why, and why
not).
"""

from visup.stepping.breakpoint_parser import parse_condition
from visup.stepping.breakpoints import StopCondition
from visup.stepping.cursor import Bookmark, PausedStep, StepResult
from visup.stepping.diff import MindChange, MindDiff, mind_diff
from visup.stepping.observation_sources import (
    LiveObservations,
    ObservationSource,
    RecordedObservations,
    ScriptedObservations,
    StepInput,
)
from visup.stepping.stepper import Stepper
from visup.stepping.watch_expressions import Breakpoint, WatchExpression

__all__ = [
    "Bookmark",
    "Breakpoint",
    "LiveObservations",
    "MindChange",
    "MindDiff",
    "ObservationSource",
    "PausedStep",
    "RecordedObservations",
    "ScriptedObservations",
    "StepInput",
    "StepResult",
    "Stepper",
    "StopCondition",
    "WatchExpression",
    "mind_diff",
    "parse_condition",
]
