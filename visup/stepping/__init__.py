"""Stepping: the debugger of an agent. Forth, back, inside a step, aside, and why.

>>> from visup.evaluation.soak import scripted
>>> from visup.settings import WatchSettings
>>> from visup.stepping import GivenFeed, Stepper
>>> from visup.supervisor import reasoning_agent
>>> stepper = Stepper(reasoning_agent(WatchSettings("script")), GivenFeed(scripted(100)))
>>> stepper.step(until="entry").reasons
('entry: An object is in view.',)
>>> stepper.back(3).frame_index
1

Read in this order: `history.py` (how all steps are kept), `stops.py` (where to stop), `stepper.py` (the
debugger), `diff.py`, `whatif.py`, `why.py`, `whynot.py`.
"""

from visup.stepping.diff import Change, MindDiff, difference
from visup.stepping.feeds import Feed, Given, GivenFeed, LiveFeed, RecordedFeed
from visup.stepping.places import Mark, Midway, Stopped
from visup.stepping.stepper import Stepper
from visup.stepping.stopping import stop_of
from visup.stepping.stops import Stop
from visup.stepping.watching import Breakpoint, Watch

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
