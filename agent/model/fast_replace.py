"""A fast version of `dataclasses.replace`.

A step changes about a hundred records of up to twenty fields; `dataclasses.replace` inspects every field
definition each time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Any, TypeVar

Record = TypeVar("Record")


def replace(record: Record, **changes: Any) -> Record:
    """The same record with some fields changed.

    Args:
        record: A dataclass whose fields are all parameters of its constructor, in order.
        changes: Field -> value.

    Returns:
        A new record; the same object if no field changes.

    Raises:
        KeyError: There is no such field.

    Example:
        >>> from visup.agent import Zone
        >>> replace(Zone("dock", ((0, 0), (1, 0), (1, 1))), name="bay").name
        'bay'
    """
    kind = type(record)
    layout = _LAYOUTS.get(kind) or _layout(kind)
    if layout.open:
        return _of_open(record, changes, layout)
    values = list(layout.read(record))
    alike = True
    for name, value in changes.items():
        at = layout.place[name]
        if values[at] is not value:
            values[at], alike = value, False
    return record if alike else kind(*values)


@dataclass(frozen=True, slots=True)
class _RecordLayout:
    """The layout of a type of record.

    Attributes:
        read: Reads all fields.
        place: Field -> its position.
        open: Whether its instances have a `__dict__` and no checks on creation: copying such records costs a
            third. Those that change in every step are declared so (without `slots`).
    """

    read: Callable[[Any], tuple[Any, ...]]
    place: Mapping[str, int]
    open: bool


_LAYOUTS: dict[type, _RecordLayout] = {}


def _of_open(record: Record, changes: Mapping[str, Any], layout: _RecordLayout) -> Record:
    held: dict[str, Any] = record.__dict__
    for name, value in changes.items():
        if held[name] is not value:
            break
    else:
        return record
    if len(held) != len(layout.place):  # cached properties of the old fields are dropped
        held = dict(zip(layout.place, layout.read(record), strict=True))
    values = {**held, **changes}
    if len(values) != len(held):
        raise KeyError(next(name for name in changes if name not in held))
    new = object.__new__(type(record))
    # A dict that is merged at once is made in half the time of one that is filled.
    object.__setattr__(new, "__dict__", values)
    return new


def _layout(kind: Any) -> _RecordLayout:
    """The layout of a type of record, cached."""
    names = [f.name for f in fields(kind)]
    one = attrgetter(names[0])
    read = attrgetter(*names) if len(names) > 1 else lambda record: (one(record),)
    open_ = not hasattr(kind, "__slots__") and not hasattr(kind, "__post_init__")
    place = {name: i for i, name in enumerate(names)}
    return _LAYOUTS.setdefault(kind, _RecordLayout(read, place, open_))
