"""`visup eval hardening`: damaged files of every kind, and races of writers.

Bars: no traceback, no hang over 10 s, no gigabyte of memory over the process's own, no crash, no code run;
writers at once lose nothing. Losses of power, hostile servers, plug-ins and terminals have tests of their own
(`tests/runs/power`, `tests/sinks`, `tests/agent/execution`, `tests/terminal`).
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.oracles.hardening.fuzzing import fuzz
from tests.oracles.hardening.subjects import subjects
from visup.agent.model.errors import SettingsError
from visup.agent.storage.journal import Journal
from visup.evaluation.figures import Progress, silent
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.view import taught_view

OUTCOMES = ("read", "refused", "raised", "slow", "crashed", "memory", "ran")
BAD = OUTCOMES[2:]
SHOWN = 20


def evaluate_hardening(
    count: int = 5000,
    seed: int = 0,
    races: int = 100,
    kind: Sequence[str] | None = None,
    *,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Read damaged files, and let writers race.

    Args:
        count: Files of each kind.
        seed: Of the damage.
        races: How often two writers begin at once.
        kind: Names of kinds; all if none.
        progress: Shows what is being done.

    Returns:
        `items` by kind, with `files` and how many were read, refused, or failed and how; `total` of these
        with `races`, `lost` (writers' work that is not there); `failures` in words.

    Raises:
        SettingsError: There is no such kind.
    """
    items: dict[str, dict[str, int]] = {}
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        known = subjects(Path(scratch))
        for name in _chosen(kind, list(known)):
            progress(name)
            found = fuzz(known[name], count, seed, Path(scratch))
            items[name] = {"files": count, **{o: found.outcomes[o] for o in OUTCOMES}}
            failures += [f"{name} {failure}" for failure in found.failures]
        progress("races")
        lost = sum(_raced(Path(scratch) / f"race {n}", n) for n in range(races))
    total = {key: sum(item[key] for item in items.values()) for key in ("files", *OUTCOMES)}
    failures += [f"{lost} of {races} races lost something"] if lost else []
    return {
        "items": items,
        "total": {**total, "races": races, "lost": lost},
        "failures": [{"text": f} for f in failures[:SHOWN]],
    }


def _chosen(wanted: Sequence[str] | None, known: list[str]) -> list[str]:
    for name in wanted or ():
        if name not in known:
            raise SettingsError(
                f"there is no kind '{name}'", expected=f"one of: {', '.join(known)}"
            )
    return list(wanted or known)


def _raced(folder: Path, number: int) -> bool:
    """Whether two writers lost something: to a database, or to a run folder."""
    folder.mkdir()
    write = _teach if number % 2 else _record
    codes = _at_once([lambda w=w: write(folder, w) for w in range(2)])
    if number % 2:
        return sorted(ModelDatabase.open(folder / "a.models").names()) != ["thing 0", "thing 1"]
    return sorted(codes) != [0, 1]  # one writes, the other is refused


def _teach(folder: Path, writer: int) -> None:
    image = np.full((60, 60, 3), 90 * writer + 30, np.uint8)
    view = taught_view(f"thing {writer}", image, [[9, 9], [40, 9], [40, 40], [9, 40]])
    ModelDatabase.open_or_new(folder / "a.models").teach([view])


def _record(folder: Path, writer: int) -> None:
    Journal(folder / "journal.sqlite").note(writer=writer)


def _at_once(works: Sequence[Any]) -> list[int]:
    """Do some things in processes of their own, at the same moment; their exit codes."""
    ready, go = os.pipe()
    children = []
    for work in works:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.close(go)
                os.read(ready, 1)
                work()
                os.read(ready, 1)
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    os.close(ready)
    os.close(go)
    return [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
