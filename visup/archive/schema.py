"""Schema of the tables of a lake. It is stable: any change needs a new `SCHEMA_VERSION`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pyarrow as pa

SCHEMA_VERSION = 1


@dataclass(frozen=True, slots=True)
class LakeColumn:
    """A column of a table.

    Attributes:
        name: Its name.
        kind: 'string', 'int64', 'float64', 'bool', 'timestamp', 'strings', 'ints' or 'labels'.
        meaning: What it holds, a phrase.
    """

    name: str
    kind: str
    meaning: str


@dataclass(frozen=True, slots=True)
class LakeTable:
    """A table of a lake.

    Attributes:
        name: Its name and that of its folder.
        meaning: What a row is, a phrase.
        columns: Columns in order; the first is always `run`.
    """

    name: str
    meaning: str
    columns: tuple[LakeColumn, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of its columns."""
        return tuple(c.name for c in self.columns)

    def arrow(self, arrow: Any) -> pa.Schema:
        """The Arrow schema, with the version in the metadata.

        Args:
            arrow: The module pyarrow.
        """
        kinds = {
            "timestamp": arrow.timestamp("us", "UTC"),
            "strings": arrow.list_(arrow.string()),
            "ints": arrow.list_(arrow.int64()),
            "labels": arrow.map_(arrow.string(), arrow.string()),
        }
        found = [
            (c.name, kinds[c.kind] if c.kind in kinds else getattr(arrow, _PLAIN[c.kind])())
            for c in self.columns
        ]
        return arrow.schema(found, metadata={"visup.lake": str(SCHEMA_VERSION)})


_PLAIN = {"string": "string", "int64": "int64", "float64": "float64", "bool": "bool_"}


def _table(name: str, meaning: str, *columns: str) -> LakeTable:
    """A table from lines `name kind: meaning`."""
    fields = [LakeColumn("run", "string", "the run")] if name != "runs" else []
    for line in columns:
        head, _, description = line.partition(": ")
        column, kind = head.split()
        fields.append(LakeColumn(column, kind, description))
    return LakeTable(name, meaning, tuple(fields))


_INTERVAL_COLUMNS = (
    "begin float64: time of the first step of the interval, s",
    "end float64: time of the first step after it; of an open interval, of the last step, s",
    "first_frame int64: number of the first frame",
    "steps int64: length in steps",
    "open bool: whether it lasted to the end of the run",
)

RUNS = _table(
    "runs",
    "a run",
    "run string: the key: source, settings and visup",
    "source string: the source, as it was named",
    "source_hash string: SHA-256 of its content; of an added run, of the recording",
    "settings_hash string: SHA-256 of the settings, with the content of the files that they name",
    "visup string: the version that processed it",
    "taken timestamp: recording time of the video, if known",
    "labels labels: labels of the clip in the manifest",
    "fps float64: frames per second of the source; null when unknown",
    "width int64: of a frame, px",
    "height int64: of a frame, px",
    "steps int64: number of processed frames",
    "seconds float64: time of the last step, s",
    "tasks strings: the tasks that were supervised",
    "actors string: actor -> models, JSON",
    "verdict string: verdict at the end; null when nothing was to be judged",
    "ended string: how the source ended: complete, truncated or stopped",
    "problem string: why it was aborted; null when it was not",
    "settings string: all settings, JSON",
)
OBJECTS = _table(
    "objects",
    "the lifetime of an object",
    "object int64: its number within the run",
    "name string: its most likely identity at the end, or 'unknown object'",
    "names strings: every identity that was ever its most likely one",
    "actors strings: every actor of a task that it was ever bound to",
    "share float64: share of the votes for its name at the end, 0 to 1",
    "confidence float64: probability that its name is right, 0 to 1",
    "confirmed bool: whether it was confirmed as an object",
    "presence string: seen, hidden or left, at the end",
    "first_seen float64: s",
    "last_seen float64: s",
    "seen_steps int64: number of steps in which it was visible",
    "first_x float64: centre when it was first seen, px",
    "first_y float64: the same",
    "last_x float64: centre when it was last seen, px",
    "last_y float64: the same",
    "area float64: mean of its visible area, px²",
)
EVENTS = _table(
    "events",
    "an event, as in `events.jsonl`",
    "number int64: its place in the run, from 0",
    "time float64: s",
    "frame int64: number of the frame",
    "kind string: such as 'coupled' or 'stage_done'",
    "severity string: info, warning or critical",
    "text string: the sentence",
    "objects ints: objects concerned, the subject first",
    "confidence float64: 0 to 1",
    "data string: details of the kind, JSON",
)
ALERTS = _table(
    "alerts",
    "an alert in its final state",
    "alert int64: its number within the run",
    "kind string: the rule or other source that raised it",
    "key string: distinguishes alerts of one kind and the same objects",
    "severity string: info, warning or critical",
    "opened float64: s",
    "updated float64: when its condition last held, s",
    "closed float64: s; null when it was still open at the end",
    "objects ints: objects concerned",
    "cause string: the sentence",
    "evidence strings: facts, a sentence each",
)
TASKS = _table(
    "tasks",
    "an interval in which the state of a task did not change",
    "task string: its name",
    "verdict string: so far",
    "stage string: the stage under way, or null",
    "confidence float64: of the verdict, 0 to 1, to two digits",
    "success float64: probability that it still succeeds, to two digits; null when not supervised",
    *_INTERVAL_COLUMNS,
)
STAGES = _table(
    "stages",
    "an interval in which a stage had this status and probability",
    "task string: its task",
    "stage string: its name",
    "status string: pending, active, progressing, paused, stalled, failing, failed, done or unknown",
    "confidence float64: probability of this status, 0 to 1, to two digits",
    *_INTERVAL_COLUMNS,
)
RELATIONS = _table(
    "relations",
    "an interval in which a relation between two objects held, or was unknown",
    "relation string: such as 'touching'; 'distance' is true for as long as the gap is known",
    "a int64: the one object",
    "b int64: the other; where order does not matter, a < b",
    "truth string: true or unknown; otherwise false while both are present",
    *_INTERVAL_COLUMNS,
    "confidence float64: lowest in the interval, 0 to 1",
    "least float64: lowest value of what is behind it: px/s of the trend and of moving_together, px of "
    "touching and of distances; null without",
    "most float64: highest value of it",
)
PERCEPTS = _table(
    "percepts",
    "percepts of one kind from one behaviour in ten seconds",
    "behaviour string: the behaviour",
    "kind string: of the percepts",
    "begin float64: of the ten seconds, s",
    "steps int64: steps with at least one",
    "count int64: how many",
    "confidence float64: their mean, 0 to 1",
)
HEALTH = _table(
    "health",
    "an interval in which the image, or a kind of percept, was in a state",
    "about string: 'image', or a kind of percept",
    "state string: of the image ok, dark, frozen, ...; of a kind of percept, unknown",
    *_INTERVAL_COLUMNS,
)

TABLES: Mapping[str, LakeTable] = MappingProxyType(
    {t.name: t for t in (RUNS, OBJECTS, EVENTS, ALERTS, TASKS, STAGES, RELATIONS, PERCEPTS, HEALTH)}
)
"""By name; `runs` first."""


def schema_text() -> str:
    """All tables in Markdown, as in `docs/archives.md`."""
    blocks = []
    for table in TABLES.values():
        rows = [f"| `{c.name}` | {c.kind} | {c.meaning} |" for c in table.columns]
        head = ["| column | type | what it holds |", "|---|---|---|"]
        blocks.append("\n".join([f"### `{table.name}`: {table.meaning}", "", *head, *rows]))
    return "\n\n".join(blocks) + "\n"
