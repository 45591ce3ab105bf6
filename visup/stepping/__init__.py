"""Stepping: the debugger of an agent. Forth, back, inside a step, aside, and why.

>>> from visup.evaluation.runtime.soak import scripted
>>> from visup.runs.settings import WatchSettings
>>> from visup.stepping import GivenFeed, Stepper
>>> from visup.runs.wiring import reasoning_agent
>>> stepper = Stepper(reasoning_agent(WatchSettings("script")), GivenFeed(scripted(100)))
>>> stepper.step(until="entry").reasons
('entry: An object, believed to be the spartan, is in view.',)
>>> stepper.back(3).frame_index
6

Read in this order: `history.py` (how all steps are kept), `stops.py` (where to stop), `stepper.py` (the
debugger), `diff.py`, `whatif.py`, `why.py`, `whynot.py`.
"""

from visup.stepping.breakpoint_parser import stop_of
from visup.stepping.breakpoints import Stop
from visup.stepping.cursor import Mark, Midway, Stopped
from visup.stepping.diff import Change, MindDiff, difference
from visup.stepping.observation_sources import Feed, Given, GivenFeed, LiveFeed, RecordedFeed
from visup.stepping.stepper import Stepper
from visup.stepping.watch_expressions import Breakpoint, Watch

__all__ = [
    "Breakpoint",
    "Change",
    "Feed",
    "Given",
    "GivenFeed",
    "LiveFeed",
    "Mark",
    "Midway",
    "MindDiff",
    "RecordedFeed",
    "Stepper",
    "Stop",
    "Stopped",
    "Watch",
    "difference",
    "stop_of",
]
