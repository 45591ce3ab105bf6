"""`visup eval hardening`: damaged files of every kind, attacks, races of writers and losses of power.

Bars: no traceback, no hang over 10 s, no gigabyte of memory over the process's own, no crash, no wrong exit
code, no code run; neither writers at once nor cuts of power lose anything. Hostile servers and plug-ins have
further tests of their own (`tests/sinks`, `tests/agent/execution`).
"""

from __future__ import annotations

import os
import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.oracles.hardening.attack_list import attacks
from tests.oracles.hardening.attacks import attacked
from tests.oracles.hardening.fuzzing import Findings, fuzz
from tests.oracles.hardening.subjects import Subject, subjects
from tests.runs.power.cuts import lost_in_cuts, recorded_run
from visup.agent.model.errors import SettingsError
from visup.agent.storage.journal import Journal
from visup.evaluation.figures import Progress, silent
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.taught_view import taught_view

OUTCOMES = ("read", "refused", "raised", "slow", "crashed", "memory", "ran")
BAD = OUTCOMES[2:]
SHOWN = 20
ATTACKS = "attacks"
FILES_FOR_AN_ATTACK = 10
"""An attack is a whole command, and takes as long as some files that are read."""


def evaluate_hardening(
    count: int = 5000,
    seed: int = 0,
    races: int = 100,
    cuts: int = 1000,
    kind: Sequence[str] | None = None,
    *,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Read damaged files, make attacks, let writers race, and cut the power.

    Args:
        count: Files of each kind.
        seed: Of the damage, the choice of attacks, and the moments of the cuts.
        races: How often two writers begin at once.
        cuts: How often the power is lost; not at all where there is no C compiler to make the disk.
        kind: Names of kinds; all if none.
        progress: Shows what is being done.

    Returns:
        `items` by kind, with `files` and how many were read, refused, or failed and how; `total` of these
        with `races`, `cuts`, `lost` (of either: what was written or told is not there); `failures` in words.

    Raises:
        SettingsError: There is no such kind.
    """
    items: dict[str, dict[str, int]] = {}
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch)
        known = subjects(place)
        for name in _chosen(kind, [*known, ATTACKS]):
            progress(name)
            found = _found(known.get(name), count, seed, place)
            items[name] = {
                "files": found.outcomes.total(),
                **{o: found.outcomes[o] for o in OUTCOMES},
            }
            failures += [f"{name} {failure}" for failure in found.failures]
        progress("races")
        raced = sum(_raced(place / f"race {n}", n) for n in range(races))
        progress("cuts of power")
        made, cut = _cut(place / "power", cuts, seed)
    total = {key: sum(item[key] for item in items.values()) for key in ("files", *OUTCOMES)}
    failures += [f"{raced} of {races} races lost something"] if raced else []
    failures += [f"after {len(cut)} of {made} cuts something was lost: {cut[0]}"] if cut else []
    return {
        "items": items,
        "total": {**total, "races": races, "cuts": made, "lost": raced + len(cut)},
        "failures": [{"text": f} for f in failures[:SHOWN]],
    }


def _found(subject: Subject | None, count: int, seed: int, place: Path) -> Findings:
    """What came of a kind of file, or of attacks."""
    if subject is not None:
        return fuzz(subject, count, seed, place)
    known = attacks()
    number = min(len(known), max(1, count // FILES_FOR_AN_ATTACK))
    names = random.Random(seed).sample(sorted(known), number)
    return attacked({name: known[name] for name in names}, place)


def _cut(folder: Path, cuts: int, seed: int) -> tuple[int, list[str]]:
    """How often the power was lost, and what was missing after the cuts that lost something."""
    folder.mkdir()
    run = recorded_run(folder) if cuts else None
    if run is None:
        return 0, []
    lost = lost_in_cuts(run, cuts, seed, folder / "again")
    return len(lost), [", ".join(what[:3]) for what in lost if what]


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
