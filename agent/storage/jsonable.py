"""Records as plain JSON values, for the journal and for programs that read visup's output.

Hand-written: pydantic neither serialises read-only mappings nor rounds numbers, which is needed for equal
runs to give equal bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum, IntEnum
from functools import cache
from math import isfinite
from typing import Any

import numpy as np

from visup.agent.model.events import Event
from visup.agent.model.mind import Mind
from visup.agent.model.object_beliefs import ObjectBelief
from visup.agent.model.records import Region
from visup.agent.model.relation_table import RelationTable


def to_jsonable(value: Any) -> Any:
    """A record as JSON-like values.

    Images and masks are left out (they are large, and the video has them); numbers are rounded to six digits,
    so that equal runs give equal bytes.

    Args:
        value: A record, or a value of one of its fields.
    """
    kind: Any = type(value)
    if kind is str or kind is int or value is None or kind is bool:
        return value
    if kind is float:
        return _number(value)
    if kind is tuple or kind is list:
        return [to_jsonable(v) for v in value]
    if isinstance(value, IntEnum):
        return value.name.lower()
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float | np.floating):
        return _number(float(value))
    if isinstance(value, np.integer | np.bool_):
        return value.item()
    if isinstance(value, np.ndarray):
        return to_jsonable(value.tolist())
    if isinstance(value, Mapping):
        return {str(k): to_jsonable(v) for k, v in value.items()}
    if isinstance(value, frozenset | set):
        return sorted(to_jsonable(v) for v in value)
    if isinstance(value, tuple | list | RelationTable):
        return [to_jsonable(v) for v in value]
    if is_dataclass(value) and not isinstance(value, type):
        return {name: to_jsonable(getattr(value, name)) for name in _written_fields(kind)}
    return str(value)


@cache
def _written_fields(kind: Any) -> tuple[str, ...]:
    """The fields of a type of record that are written."""
    omitted = _OMITTED.get(kind, frozenset())
    return tuple(f.name for f in fields(kind) if f.name not in omitted)


_OMITTED: Mapping[type, frozenset[str]] = {
    Region: frozenset({"mask", "contour", "motion"}),
    Mind: frozenset({"memory"}),
}


def _number(x: float) -> float | str:
    """A number; infinity and NaN, which JSON lacks, are written as words."""
    return round(x, 6) if isfinite(x) else str(x)


def event_record(event: Event) -> dict[str, Any]:
    """An event as written to `events.jsonl`."""
    line: dict[str, Any] = to_jsonable(event)
    return line


def object_summary(belief: ObjectBelief) -> dict[str, Any]:
    """A summary of the beliefs about an object, as written to the journal."""
    region = belief.region
    return {
        "id": belief.id,
        "presence": belief.presence.value,
        "confirmed": belief.confirmed,
        "region": region.id,
        "bbox": list(region.bbox),
        "area": to_jsonable(region.area),
        "velocity": to_jsonable(region.velocity),
        "cut": region.cut,
        "candidates": [[c.name, to_jsonable(c.share)] for c in belief.candidates],
        "depth": to_jsonable(belief.depth),
    }
