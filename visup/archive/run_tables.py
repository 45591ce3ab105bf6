"""Converts the journal of a finished run to the rows of all tables of a lake, deterministically.

Events, alerts and the verdict are taken from the journal. Relations, stage probabilities and identities are
not in it: the reasoning is replayed, which reproduces the beliefs of the run exactly.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from visup.agent import Mind, ObjectBelief, Observation, Presence
from visup.agent.model.errors import OutputError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.agent.storage.jsonable import to_jsonable
from visup.archive.relation_intervals import RelationIntervals
from visup.archive.schema import TABLES
from visup.archive.value_intervals import IntervalCollector, StepTime
from visup.runs.replay import replay
from visup.runs.settings import WatchSettings

Rows = list[tuple[Any, ...]]
RunTables = Mapping[str, Rows]
"""Table -> rows in column order."""

PERCEPT_BUCKET_S = 10.0


@dataclass(frozen=True, slots=True)
class Provenance:
    """The provenance of a run.

    Attributes:
        run: Its key in the lake.
        source_hash: SHA-256 of the content of the source.
        settings_hash: SHA-256 of the settings.
        taken: When the video was recorded, seconds since the epoch, or None.
        labels: Manifest labels of the clip.
    """

    run: str
    source_hash: str
    settings_hash: str
    taken: float | None = None
    labels: Mapping[str, str] = field(default_factory=dict)


def run_tables(
    recording: Recording,
    settings: WatchSettings,
    given: Provenance,
    also: Callable[[Step], None] | None = None,
) -> RunTables:
    """The rows of a run.

    Args:
        recording: Its journal; the run has ended.
        settings: Settings of the run; see `with_inputs` for one whose files have moved.
        given: Its provenance.
        also: Receives each step, too.

    Returns:
        The rows of every table of `TABLES`, in an order that depends only on the run.

    Raises:
        VisupError: The run has not ended, or its journal is damaged.
    """
    facts = recording.facts()
    if not facts.get("ended"):
        raise OutputError(
            "the run has not ended",
            where=str(recording.path),
            expected="a run that was watched to its end",
            hint="wait, or go on with it: visup watch --resume",
        )
    steps = StepTables()

    def on_step(step: Step) -> None:
        steps.add(step)
        if also:
            also(step)

    replay(recording, settings, on_step=on_step)
    tables = {
        "runs": [_run_row(facts, settings, steps, given)],
        "events": list(_event_rows(recording.events())),
        "alerts": [_alert_row(a) for _, a in sorted(recording.alerts().items())],
        **steps.finish(),
    }
    return {
        name: [tuple(row) if name == "runs" else (given.run, *row) for row in tables[name]]
        for name in TABLES
    }


@dataclass(slots=True)
class _ObjectRecord:
    """The accumulated record of an object."""

    belief: ObjectBelief
    first: tuple[float, float]
    names: set[str] = field(default_factory=set)
    actors: set[str] = field(default_factory=set)
    seen_steps: int = 0
    area: float = 0.0

    def row(self) -> tuple[Any, ...]:
        """Its row in the table `objects`."""
        b = self.belief
        numbers = (*self.first, *b.region.centroid, self.area / max(1, self.seen_steps))
        return (
            b.id,
            b.name,
            sorted(self.names),
            sorted(self.actors),
            _rounded(b.strength),
            _rounded(b.confidence),
            b.confirmed,
            b.presence.value,
            _rounded(b.first_seen),
            _rounded(b.last_seen),
            self.seen_steps,
            *map(_rounded, numbers),
        )


class StepTables:
    """Collects the steps of a run into the rows of the tables derived from them."""

    def __init__(self) -> None:
        self.last: StepTime | None = None
        self.size: tuple[int, int] = (0, 0)
        self._relations = RelationIntervals()
        self._tasks: IntervalCollector[str, tuple[Any, ...]] = IntervalCollector()
        self._stages: IntervalCollector[tuple[str, str], tuple[Any, ...]] = IntervalCollector()
        self._health: IntervalCollector[str, str] = IntervalCollector()
        self._objects: dict[int, _ObjectRecord] = {}
        self._percepts: dict[tuple[str, str, float], list[float]] = {}

    def add(self, step: Step) -> None:
        """Add one step."""
        mind = step.mind
        at = StepTime(self.last.number + 1 if self.last else 0, step.frame_index, step.time)
        self.last, self.size = at, mind.frame_size
        self._relations.add(at, mind.relations)
        self._tasks.add(at, _tasks_of(mind))
        self._stages.add(at, _stages_of(mind))
        unknown = dict.fromkeys(sorted(mind.unknown), "unknown")
        self._health.add(at, {"image": mind.health.status.value, **unknown})
        self._add_objects(mind)
        self._add_percepts(step.observation)

    def finish(self) -> dict[str, Rows]:
        """The rows of all these tables, without the run column."""
        last = self.last or StepTime(0, 0, 0.0)
        return {
            "objects": [record.row() for _, record in sorted(self._objects.items())],
            "tasks": sorted(
                ((s.key, *s.value, *s.columns) for s in self._tasks.finish(last)), key=_by_begin(5)
            ),
            "stages": sorted(
                ((*s.key, *s.value, *s.columns) for s in self._stages.finish(last)),
                key=_by_begin(4),
            ),
            "relations": self._relations.finish(),
            "percepts": [
                (*key, int(steps), int(count), _rounded(total / count) if count else None)
                for key, (steps, count, total) in sorted(self._percepts.items())
            ],
            "health": sorted(
                ((s.key, s.value, *s.columns) for s in self._health.finish(last)), key=_by_begin(2)
            ),
        }

    def _add_objects(self, mind: Mind) -> None:
        playing = [(b.actor, b.object_id) for t in mind.tasks for b in t.bindings if b.object_id]
        for number, belief in mind.objects.items():
            record = self._objects.setdefault(
                number,
                _ObjectRecord(belief, (belief.region.centroid[0], belief.region.centroid[1])),
            )
            record.belief = belief
            record.names.add(belief.name)
            record.actors |= {actor for actor, played in playing if played == number}
            if belief.presence is Presence.SEEN:
                record.seen_steps += 1
                record.area += float(belief.region.area)

    def _add_percepts(self, observation: Observation) -> None:
        begin = observation.time // PERCEPT_BUCKET_S * PERCEPT_BUCKET_S
        for report in observation.reports:
            for kind in sorted({p.kind for p in report.percepts}):
                of = [p.confidence for p in report.percepts if p.kind == kind]
                sums = self._percepts.setdefault((report.behaviour, kind, begin), [0.0, 0.0, 0.0])
                for n, more in enumerate((1.0, float(len(of)), sum(of))):
                    sums[n] += more


def _by_begin(column: int) -> Any:
    return lambda row: (row[column], str(row[0]), str(row[1]))


def _tasks_of(mind: Mind) -> dict[str, tuple[Any, ...]]:
    return {
        t.task: (
            t.verdict.value,
            t.current,
            _digits(t.confidence),
            None if t.success is None else _digits(t.success),
        )
        for t in mind.tasks
    }


def _stages_of(mind: Mind) -> dict[tuple[str, str], tuple[Any, ...]]:
    return {
        (t.task, s.stage): (s.status.value, _digits(s.confidence))
        for t in mind.tasks
        for s in t.stages
    }


def _run_row(
    facts: Mapping[str, Any], settings: WatchSettings, steps: StepTables, given: Provenance
) -> tuple[Any, ...]:
    last, (width, height) = steps.last, steps.size
    recorded = facts.get("settings", {})
    return (
        given.run,
        str(facts.get("source", recorded.get("source", ""))),
        given.source_hash,
        given.settings_hash,
        str(facts.get("visup", "")),
        given.taken,
        sorted(given.labels.items()),
        facts.get("fps"),
        width,
        height,
        last.number + 1 if last else 0,
        _rounded(last.time) if last else 0.0,
        list(recorded.get("tasks", ())),
        _json({actor: list(models) for actor, models in settings.actors.items()}),
        facts.get("verdict"),
        facts["ended"],
        facts.get("problem"),
        _json(to_jsonable(recorded)),
    )


def _event_rows(events: Iterable[Mapping[str, Any]]) -> Iterable[tuple[Any, ...]]:
    for number, e in enumerate(events):
        yield (
            number,
            e["time"],
            e["frame_index"],
            e["kind"],
            e["severity"],
            e["text"],
            list(e["objects"]),
            e["confidence"],
            _json(e["data"]),
        )


def _alert_row(a: Mapping[str, Any]) -> tuple[Any, ...]:
    columns = ("id", "kind", "key", "severity", "opened", "updated", "closed")
    lists = (list(a["objects"]), a["cause"], list(a["evidence"]))
    return (*(a[c] for c in columns), *lists)


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, sort_keys=True)


def _rounded(value: float) -> float:
    return round(float(value), 6)


def _digits(value: float) -> float:
    return round(float(value), 2)
