"""Saved beliefs of a run, step by step, for fast evaluation of conditions about relations.

Replaying the reasoning of a run takes seconds. A condition that names only relations depends on the objects
present, their identities and roles, and the relations between them; these are saved when the run is added,
and evaluated by the same code. A run without this file, or with one of another version of visup, is replayed.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief, Presence, Region, RelationTable, TaskBelief, Verdict
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT, Candidate
from visup.agent.model.relation_columns import RelationBlock
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Binding
from visup.archive.finding.pattern_evaluator import before_tasks
from visup.archive.lake import BELIEFS
from visup.rules.relations.reasoner import COLUMNS, NAMES
from visup.rules.safety.compiled_rules import compile_rules
from visup.rules.safety.expression import Expression
from visup.version import __version__

FORMAT = 1
STATES = 1 + max(row for column in COLUMNS.each for row in column.rows)
CONFIDENCE_ROWS = tuple(sorted({column.confidence for column in COLUMNS.each}))
"""Rows of the numbers that are confidences; the others are not needed."""
NUMBERS = 1 + max(
    max(c.confidence, -1 if c.value is None else c.value, -1 if c.sigma is None else c.sigma)
    for c in COLUMNS.each
)
NO_REGION = cast("Region", None)
"""Region of an object: not saved, and not used by relations."""
Cast = Mapping[str, Any]
"""The objects, names and roles of a step as JSON; saved when they change."""


def depends_only_on_relations(pattern: Expression) -> bool:
    """Whether a condition depends only on relations between objects."""
    prepared = compile_rules((pattern.rule,))
    return not prepared.facts and not prepared.quantities and set(prepared.relations) <= set(NAMES)


@dataclass(slots=True)
class BeliefRecorder:
    """Collects the beliefs of a run step by step."""

    times: list[float] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)
    states: list[NDArray[np.int8]] = field(default_factory=list)
    sure: list[NDArray[np.float64]] = field(default_factory=list)
    casts: list[tuple[int, Cast]] = field(default_factory=list)
    whole: bool = True

    def __call__(self, step: Step) -> None:
        """Add one step."""
        mind = before_tasks(step.mind)
        table = mind.relations
        if not isinstance(table, RelationTable):
            table = RelationTable(extra=table)
        blocks = [block for block in table.parts if block.columns is COLUMNS]
        self.whole = self.whole and _is_all(table, blocks)
        found = _cast_of(mind, table.ids if blocks else None)
        if not self.casts or self.casts[-1][1] != found:
            self.casts.append((len(self.times), found))
        self.times.append(step.time)
        self.frames.append(step.frame_index)
        for block in blocks:
            self.states.append(block.state[:STATES].ravel())
            self.sure.append(block.numbers[list(CONFIDENCE_ROWS)].ravel())

    def content(self) -> bytes:
        """The content of the file; empty if a plug-in's reasoner contributed relations."""
        if not self.whole:
            return b""
        header = {"format": FORMAT, "visup": __version__, "casts": self.casts}
        out = BytesIO()
        np.savez_compressed(
            out,
            times=np.array(self.times),
            frames=np.array(self.frames, np.int64),
            states=np.concatenate([*self.states, np.empty(0, np.int8)]),
            sure=np.concatenate([*self.sure, np.empty(0)]),
            told=np.frombuffer(json.dumps(header).encode(), np.uint8),
        )
        return out.getvalue()


def read_minds(folder: Path) -> list[Mind] | None:
    """The minds of a run as far as saved; None if the file is missing or of another version of visup."""
    try:
        # Read into memory first: NumPy would leave a damaged file open.
        with np.load(BytesIO((folder / BELIEFS).read_bytes()), allow_pickle=False) as kept:
            header = json.loads(kept["told"].tobytes())
            if (header["format"], header["visup"]) != (FORMAT, __version__):
                return None
            return list(
                _minds(header["casts"], *(kept[k] for k in ("times", "frames", "states", "sure")))
            )
    except (OSError, ValueError, KeyError, IndexError, TypeError, zipfile.BadZipFile):
        return None


def _is_all(table: RelationTable, blocks: list[RelationBlock]) -> bool:
    """Whether one block has all relations of the condition language, without additions by plug-ins."""
    others = {n for part in table.parts if part.columns is not COLUMNS for n in part.columns.named}
    return len(blocks) <= 1 and others.union(r.name for r in table.extra).isdisjoint(NAMES)


def _cast_of(mind: Mind, related: tuple[int, ...] | None) -> Cast:
    names = {str(b.id): b.name for b in mind.present()}
    played = [[b.actor, b.object_id] for t in mind.tasks for b in t.bindings if b.object_id]
    return {
        "names": names,
        "related": None if related is None else list(related),
        "played": played,
        "actors": {actor: list(models) for actor, models in mind.actors.items()},
        "unknown": sorted(mind.unknown),
    }


def _minds(
    casts: list[tuple[int, Cast]],
    times: NDArray[np.float64],
    frames: NDArray[np.int64],
    states: NDArray[np.int8],
    sure: NDArray[np.float64],
) -> Iterator[Mind]:
    changes, at = dict(casts), [0, 0]
    made, pairs = Mind(), -1
    ids: tuple[int, ...] = ()
    for number, (time, frame) in enumerate(zip(times.tolist(), frames.tolist(), strict=True)):
        if number in changes:
            made, related = _mind_of(changes[number])
            ids = tuple(related or ())
            pairs = -1 if related is None else len(ids) * (len(ids) - 1) // 2
        table = RelationTable(ids)
        if pairs >= 0:
            ends = at[0] + STATES * pairs, at[1] + len(CONFIDENCE_ROWS) * pairs
            state = states[at[0] : ends[0]].reshape(STATES, pairs)
            numbers = np.full((NUMBERS, pairs), np.nan)
            numbers[list(CONFIDENCE_ROWS)] = sure[at[1] : ends[1]].reshape(
                len(CONFIDENCE_ROWS), pairs
            )
            table = RelationTable(
                ids, (RelationBlock(COLUMNS, state, _no_start_times(pairs), numbers),)
            )
            at = list(ends)
        yield Mind(
            time=time,
            frame_index=frame,
            objects=made.objects,
            relations=table,
            tasks=made.tasks,
            unknown=made.unknown,
            actors=made.actors,
        )


@lru_cache(maxsize=64)
def _no_start_times(pairs: int) -> NDArray[np.float64]:
    """Since when relations hold: not saved, and not used."""
    return np.zeros((STATES, pairs))


def _mind_of(cast_: Cast) -> tuple[Mind, list[int] | None]:
    """The mind of a step, and the objects between which relations are saved."""
    played = tuple(Binding(actor, (), number) for actor, number in cast_["played"])
    mind = Mind(
        objects={
            int(number): _object(int(number), name) for number, name in cast_["names"].items()
        },
        tasks=(TaskBelief("", Verdict.UNKNOWN, bindings=played),) if played else (),
        unknown=frozenset(cast_["unknown"]),
        actors={actor: tuple(models) for actor, models in cast_["actors"].items()},
    )
    return mind, cast_["related"]


@lru_cache(maxsize=1024)
def _object(number: int, name: str) -> ObjectBelief:
    known = () if name == UNKNOWN_OBJECT else (Candidate(name, 1.0, 1.0),)
    return ObjectBelief(number, NO_REGION, Presence.SEEN, 0.0, 0.0, True, known)
