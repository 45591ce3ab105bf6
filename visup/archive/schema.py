"""The schema of the tables of a lake. It is stable: any change needs a new `SCHEMA_VERSION`."""

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
        """Its schema for Arrow, with the version in the metadata.

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
    "begin float64: time of the first step at which it was so, s",
    "end float64: time of the first step at which it was not; of what was open, of the last step, s",
    "first_frame int64: number of the first frame",
    "steps int64: how many steps it lasted",
    "open bool: whether it was still so when the run ended",
)

RUNS = _table(
    "runs",
    "a run",
    "run string: the key: source, settings and visup",
    "source string: what was watched, as it was named",
    "source_hash string: SHA-256 of its content; of a run that was added, of what was recorded",
    "settings_hash string: SHA-256 of the settings, with the content of the files that they name",
    "visup string: the version that watched",
    "taken timestamp: when the video was made, as far as is known",
    "labels labels: what the manifest says of the clip",
    "fps float64: frames per second of the source; null when nobody knows",
    "width int64: of a frame, px",
    "height int64: of a frame, px",
    "steps int64: how many frames were looked at",
    "seconds float64: time of the last step, s",
    "tasks strings: the tasks that were supervised",
    "actors string: actor -> models, JSON",
    "verdict string: how it ended; null when nothing was to be judged",
    "ended string: how the source ended: complete, truncated or stopped",
    "problem string: why it broke off; null when it did not",
    "settings string: all settings, JSON",
)
OBJECTS = _table(
    "objects",
    "the life of an object",
    "object int64: its number within the run",
    "name string: its likeliest identity at last, or 'unknown object'",
    "names strings: every identity that it was ever likeliest to have",
    "actors strings: every actor of a task that it was ever believed to play",
    "share float64: share of the votes for its name at last, 0 to 1",
    "confidence float64: how likely its name is right, 0 to 1",
    "confirmed bool: whether it was more than a passing impression",
    "presence string: seen, hidden or left, at last",
    "first_seen float64: s",
    "last_seen float64: s",
    "seen_steps int64: in how many steps it was in sight",
    "first_x float64: centre when it was first seen, px",
    "first_y float64: the same",
    "last_x float64: centre when it was last seen, px",
    "last_y float64: the same",
    "area float64: mean of its area in sight, px²",
)
EVENTS = _table(
    "events",
    "something that happened, as in `events.jsonl`",
    "number int64: its place in the run, from 0",
    "time float64: s",
    "frame int64: number of the frame",
    "kind string: such as 'coupled' or 'stage_done'",
    "severity string: info, warning or critical",
    "text string: the sentence",
    "objects ints: whom it concerns, the subject first",
    "confidence float64: 0 to 1",
    "data string: details of the kind, JSON",
)
ALERTS = _table(
    "alerts",
    "an alert, as it was last",
    "alert int64: its number within the run",
    "kind string: the rule, or what else raised it",
    "key string: what tells two of one kind and the same objects apart",
    "severity string: info, warning or critical",
    "opened float64: s",
    "updated float64: when its condition last held, s",
    "closed float64: s; null when it was still open at the end",
    "objects ints: whom it concerns",
    "cause string: the sentence",
    "evidence strings: facts, a sentence each",
)
TASKS = _table(
    "tasks",
    "a stretch in which a task stood as it did",
    "task string: its name",
    "verdict string: so far",
    "stage string: the stage under way, or null",
    "confidence float64: of the verdict, 0 to 1, to two digits",
    "success float64: probability that it still ends well, to two digits; null when not followed",
    *_INTERVAL_COLUMNS,
)
STAGES = _table(
    "stages",
    "a stretch in which a stage had this status and probability",
    "task string: its task",
    "stage string: its name",
    "status string: pending, active, progressing, paused, stalled, failing, failed, done or unknown",
    "confidence float64: how likely it has this status, 0 to 1, to two digits",
    *_INTERVAL_COLUMNS,
)
RELATIONS = _table(
    "relations",
    "a stretch in which a relation held of two objects, or was unknown",
    "relation string: such as 'touching'; 'distance' is true for as long as the gap is known",
    "a int64: the one object",
    "b int64: the other; where order does not matter, a < b",
    "truth string: true or unknown; what is neither is false while both are there",
    *_INTERVAL_COLUMNS,
    "confidence float64: lowest of the stretch, 0 to 1",
    "least float64: lowest value of what is behind it: px/s of the trend and of moving_together, px of "
    "touching and of distances; null without",
    "most float64: highest value of it",
)
PERCEPTS = _table(
    "percepts",
    "what a behaviour gave of one kind in ten seconds",
    "behaviour string: who perceived",
    "kind string: of the percepts",
    "begin float64: of the ten seconds, s",
    "steps int64: steps with at least one",
    "count int64: how many",
    "confidence float64: their mean, 0 to 1",
)
HEALTH = _table(
    "health",
    "a stretch in which the image, or what is perceived, was in a state",
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
