"""Sequences of records that become tables for pandas and Arrow."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from enum import Enum
from importlib import import_module
from types import NoneType
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin, get_type_hints, overload

from rich.console import RenderableType

from visup.agent.model.errors import ExtraMissingError
from visup.agent.storage.jsonable import to_jsonable
from visup.api.display import rows
from visup.terminal.display import html_of

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

Record_co = TypeVar("Record_co", covariant=True)
EXTRA = "tables"


class Records(Sequence[Record_co]):
    """A sequence of records of one kind, which converts to a table.

    A table has one column for each field whose values are plain: numbers, texts, and sequences of
    them. Details without a fixed form (`Event.data`) are JSON text, so that every table of a
    kind has the same columns of the same types.

    Args:
        kind: The class of the records, a dataclass.
        items: The records.
    """

    def __init__(self, kind: type[Record_co], items: Iterable[Record_co]) -> None:
        self.kind = kind
        self._items = tuple(items)

    @overload
    def __getitem__(self, index: int) -> Record_co: ...
    @overload
    def __getitem__(self, index: slice) -> Records[Record_co]: ...
    def __getitem__(self, index: int | slice) -> Record_co | Records[Record_co]:
        """One record, or some of them."""
        return (
            Records(self.kind, self._items[index])
            if isinstance(index, slice)
            else self._items[index]
        )

    def __len__(self) -> int:
        return len(self._items)

    def __repr__(self) -> str:
        return f"<{len(self)} records of {self.kind.__name__}>"

    def __rich__(self) -> RenderableType:
        return rows(repr(self)[1:-1], self)

    def _repr_html_(self) -> str:
        return html_of(rows(repr(self)[1:-1], self))

    def to_pandas(self) -> pd.DataFrame:
        """The records as a data frame, one per row.

        Raises:
            ExtraMissingError: pandas is not installed.
        """
        pandas = _imported("pandas")
        frame: pd.DataFrame = pandas.DataFrame(self._rows(), columns=list(columns(self.kind)))
        return frame

    def to_arrow(self) -> pa.Table:
        """The records as an Arrow table, one per row.

        Raises:
            ExtraMissingError: pyarrow is not installed.
        """
        arrow = _imported("pyarrow")
        types = columns(self.kind).items()
        schema = arrow.schema([(name, _arrow_type(arrow, kind)) for name, kind in types])
        table: pa.Table = arrow.Table.from_pylist(self._rows(), schema=schema)
        return table

    def _rows(self) -> list[dict[str, Any]]:
        types = columns(self.kind)
        return [{n: _cell(getattr(item, n), t) for n, t in types.items()} for item in self._items]


Column = tuple[type, ...]
"""(float,) for numbers, (tuple, float) for sequences of numbers, (Mapping,) for details, and so on."""


def columns(kind: type) -> Mapping[str, Column]:
    """The columns of a table of records.

    Args:
        kind: A dataclass.

    Returns:
        Name -> type of its values; fields that hold other records or arrays have none.
    """
    hints = get_type_hints(kind)
    by_name = {f.name: _column(hints[f.name]) for f in fields(kind)}
    return {name: column for name, column in by_name.items() if column is not None}


def _column(hint: Any) -> Column | None:
    options = [h for h in get_args(hint) if h is not NoneType] if NoneType in get_args(hint) else []
    hint = options[0] if len(options) == 1 else hint
    origin, args = get_origin(hint), get_args(hint)
    if isinstance(hint, type) and issubclass(hint, Enum):
        return (str,)
    if hint in (bool, int, float, str):
        return (hint,)
    if origin is tuple and args[0] in (bool, int, float, str):
        return (tuple, args[0])
    return (Mapping,) if origin is not None and issubclass(origin, Mapping) else None


def _cell(value: Any, column: Column) -> Any:
    plain = to_jsonable(value)
    if column == (Mapping,) and plain is not None:
        return json.dumps(plain, ensure_ascii=False, sort_keys=True)
    return value if column == (float,) else plain


def _arrow_type(arrow: Any, column: Column) -> Any:
    names = {bool: "bool_", int: "int64", float: "float64", str: "string", Mapping: "string"}
    element = getattr(arrow, names[column[-1]])()
    return arrow.list_(element) if column[0] is tuple else element


def _imported(library: str) -> Any:
    try:
        return import_module(library)
    except ImportError as error:
        raise ExtraMissingError(f"a table for {library}", EXTRA) from error
