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
    if layout.has_dict:
        return _replace_in_dict(record, changes, layout)
    values = list(layout.read(record))
    unchanged = True
    for name, value in changes.items():
        position = layout.index[name]
        if values[position] is not value:
            values[position], unchanged = value, False
    return record if unchanged else kind(*values)


@dataclass(frozen=True, slots=True)
class _RecordLayout:
    """The layout of a type of record.

    Attributes:
        read: Reads all fields.
        index: Field -> its position.
        has_dict: Whether its instances have a `__dict__` and no checks on creation: copying such records
            costs a third. Those that change in every step are declared so (without `slots`).
    """

    read: Callable[[Any], tuple[Any, ...]]
    index: Mapping[str, int]
    has_dict: bool


_LAYOUTS: dict[type, _RecordLayout] = {}


def _replace_in_dict(record: Record, changes: Mapping[str, Any], layout: _RecordLayout) -> Record:
    current: dict[str, Any] = record.__dict__
    for name, value in changes.items():
        if current[name] is not value:
            break
    else:
        return record
    if len(current) != len(layout.index):  # cached properties of the old fields are dropped
        current = dict(zip(layout.index, layout.read(record), strict=True))
    values = {**current, **changes}
    if len(values) != len(current):
        raise KeyError(next(name for name in changes if name not in current))
    new = object.__new__(type(record))
    # A dict that is merged at once is made in half the time of one that is filled.
    object.__setattr__(new, "__dict__", values)
    return new


def _layout(kind: Any) -> _RecordLayout:
    """The layout of a type of record, cached."""
    names = [f.name for f in fields(kind)]
    first_field = attrgetter(names[0])
    read = attrgetter(*names) if len(names) > 1 else lambda record: (first_field(record),)
    has_dict = not hasattr(kind, "__slots__") and not hasattr(kind, "__post_init__")
    index = {name: i for i, name in enumerate(names)}
    return _LAYOUTS.setdefault(kind, _RecordLayout(read, index, has_dict))
