"""visup, the visual supervisor: watches machines work and reports whether the work goes well.

    import visup

    for event in visup.watch("clip.mp4", task="dock", models="things.models").narrate():
        print(f"{event.time:6.1f} s  {event.text}")

`__all__` is the public API; docs/api.md documents it with examples. Names are loaded when they
are first used, so that `import visup` takes next to no time.

To read the source, start here:

1. `visup/agent/model/`: the records of a step (`records.py`) and the mental model (`mind.py`).
2. `visup/agent/cycle/agent.py`: the cogitation-action cycle on one screen.
3. `visup/percepts/`: perception (video, motion, shape, depth, health), each part a behaviour.
4. `visup/rules/` and `visup/tasks/`: interpretation of the scene, and verification of tasks.
5. `visup/runs/wiring.py`: how everything is wired together; `visup/cli.py`: the command.

`docs/tour.md` follows one frame through all of it, and `docs/architecture.md` is the map.
"""

from typing import TYPE_CHECKING

from visup.agent.lazy_names import lazy_names

if TYPE_CHECKING:
    from visup.agent import (
        Alert,
        Behaviour,
        Contract,
        Directive,
        Event,
        Frame,
        Mind,
        Observation,
        Percept,
        Region,
        Severity,
        Verdict,
        VisupError,
    )
    from visup.agent.cycle.agent import Agent
    from visup.agent.model.step import Step
    from visup.api import RecordedRun, Run, open_run, watch
    from visup.percepts.shape.database.model_database import ModelDatabase
    from visup.runs.settings import WatchSettings as Settings
    from visup.stepping import Stepper
    from visup.tasks import Task, load_task
    from visup.teaching import learn, teach
    from visup.version import __version__

__all__ = [
    "Agent",
    "Alert",
    "Behaviour",
    "Contract",
    "Directive",
    "Event",
    "Frame",
    "Mind",
    "ModelDatabase",
    "Observation",
    "Percept",
    "RecordedRun",
    "Region",
    "Run",
    "Settings",
    "Severity",
    "Step",
    "Stepper",
    "Task",
    "Verdict",
    "VisupError",
    "__version__",
    "learn",
    "load_task",
    "open_run",
    "teach",
    "watch",
]

# Where each name is found when it is first used; type checkers and editors read the imports above.
_HOMES = {
    "visup.agent": (
        *("Alert", "Behaviour", "Contract", "Directive", "Event", "Frame", "Mind", "Observation"),
        *("Percept", "Region", "Severity", "Verdict", "VisupError"),
    ),
    "visup.agent.cycle.agent": ("Agent",),
    "visup.agent.model.step": ("Step",),
    "visup.api": ("RecordedRun", "Run", "open_run", "watch"),
    "visup.percepts.shape.database.model_database": ("ModelDatabase",),
    "visup.runs.settings": ("WatchSettings as Settings",),
    "visup.stepping": ("Stepper",),
    "visup.tasks": ("Task", "load_task"),
    "visup.teaching": ("learn", "teach"),
    "visup.version": ("__version__",),
}


def _check_room(module: str) -> None:
    """Report too little memory before the libraries are loaded."""
    if module not in _LIGHT:
        from visup.agent.memory_limit import check_memory

        check_memory()


_LIGHT = frozenset({"visup.agent", "visup.version"})
__getattr__ = lazy_names(__name__, _HOMES, _check_room)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
