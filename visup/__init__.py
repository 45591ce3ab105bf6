"""visup, the visual supervisor: it watches machines work and says in plain words whether it goes well.

Where to read first:

1. `visup/agent/model/`: what flows (`records.py`) and what is believed (`mind.py`).
2. `visup/agent/cycle/agent.py`: the cogitation-action cycle on one screen.
3. `visup/percepts/`: seeing (video, motion, shape, depth, health), each as a behaviour.
4. `visup/rules/` and `visup/tasks/`: interpreting what is seen, and verifying tasks.
5. `visup/runs/wiring.py`: all of it wired together; `visup/cli.py`: the command.

`docs/tour.md` follows one frame through all of it.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("visup")
except PackageNotFoundError:  # run from a checkout that was never installed
    __version__ = "0+unknown"
