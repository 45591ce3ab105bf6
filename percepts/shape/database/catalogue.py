"""Lazy sequences of the views and shapes in a database file.

A database of a hundred thousand views is a few arrays and one open file. `Views` and `Shapes` create an
element from its record on access; recently used shapes are cached.
"""

from __future__ import annotations

import sqlite3
import weakref
from collections import OrderedDict
from collections.abc import Collection, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import DatabaseError
from visup.percepts.shape.database.file_format import FileContents, damaged
from visup.percepts.shape.database.file_reader import open_checked, read_contents, read_shape
from visup.percepts.shape.index.view_records import Direction, InvalidRecordError, ModelView, decode
from visup.percepts.shape.matching.shape_similarity import Shape

MAX_CACHED = 4096
"""Most shapes cached in memory, about 20 kB each."""


class Views(Sequence[ModelView]):
    """The views of a database.

    Args:
        contents: The contents of the file.
    """

    def __init__(self, contents: FileContents) -> None:
        self._contents = contents

    @classmethod
    def read(cls, path: Path) -> Views:
        """The views of a file.

        Raises:
            DatabaseError: It is not a valid model database.
        """
        return cls(read_contents(path))

    def __len__(self) -> int:
        return len(self._contents.views)

    @overload
    def __getitem__(self, key: int) -> ModelView: ...
    @overload
    def __getitem__(self, key: slice) -> tuple[ModelView, ...]: ...
    def __getitem__(self, key: int | slice) -> ModelView | tuple[ModelView, ...]:
        """A view by its number in the file, from 0; or a slice."""
        if isinstance(key, slice):
            return tuple(self._view(k) for k in range(len(self))[key])
        return self._view(range(len(self))[key])

    def __iter__(self) -> Iterator[ModelView]:
        return (self._view(k) for k in range(len(self)))

    def name_of(self, number: int) -> str:
        """Name of a view's model, by the view's number in the file."""
        return self.names[int(self.records[number]["model"])]

    def _view(self, number: int) -> ModelView:
        row = self.records[number]
        direction = None if np.isnan(row["direction"][0]) else _direction(row["direction"])
        return ModelView(
            id=number + 1,
            name=self.names[row["model"]],
            number=int(row["number"]),
            direction=direction,
            area=None if np.isnan(row["area"]) else float(row["area"]),
            cut=bool(row["cut"]),
            also=self._also.get(number, ()),
            smoothing=float(row["smoothing"]),
        )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the models, in the order of the file."""
        return self._contents.names

    @property
    def records(self) -> NDArray[Any]:
        """(V,) records of `view_records.VIEW`: everything but the shapes."""
        return self._contents.views

    @property
    def cut(self) -> NDArray[np.bool_]:
        """(V,) whether the image's border cuts each silhouette."""
        return np.asarray(self.records["cut"] > 0)

    @cached_property
    def _also(self) -> dict[int, tuple[Direction, ...]]:
        out: dict[int, tuple[Direction, ...]] = {}
        for row in self._contents.also:
            number = int(row["view"])
            out[number] = (*out.get(number, ()), _direction(row["direction"]))
        return out

    def named(self, names: Collection[str] | None) -> NDArray[np.intp]:
        """Numbers of the views of these models, ascending; of all when None."""
        if names is None:
            return np.arange(len(self))
        codes = [code for code, name in enumerate(self.names) if name in names]
        return np.flatnonzero(np.isin(self.records["model"], codes))


def _direction(vector: NDArray[np.float64]) -> Direction:
    x, y, z = vector.tolist()
    return (x, y, z)


class Shapes(Sequence[Shape]):
    """The shapes of a database, read one by one on access. Thread-safe.

    Args:
        path: The file.
        views: Its views.
    """

    def __init__(self, path: Path, views: Views) -> None:
        self._path = path
        self._views = views
        self._cache: OrderedDict[int, Shape] = OrderedDict()
        self._lock = Lock()

    def __len__(self) -> int:
        return len(self._views)

    @overload
    def __getitem__(self, key: int) -> Shape: ...
    @overload
    def __getitem__(self, key: slice) -> tuple[Shape, ...]: ...
    def __getitem__(self, key: int | slice) -> Shape | tuple[Shape, ...]:
        """A shape by its view's number in the file, from 0; or a slice.

        Raises:
            DatabaseError: The file is damaged there.
        """
        if isinstance(key, slice):
            return tuple(self._shape(k) for k in range(len(self))[key])
        return self._shape(range(len(self))[key])

    @cached_property
    def _file(self) -> sqlite3.Connection:
        file = open_checked(self._path)
        weakref.finalize(self, file.close)
        return file

    def _shape(self, number: int) -> Shape:
        with self._lock:
            cached = self._cache.get(number)
            if cached is None:
                cached = self._cache[number] = self._read(number)
                if len(self._cache) > MAX_CACHED:
                    self._cache.popitem(last=False)
            else:
                self._cache.move_to_end(number)
            return cached

    def _read(self, number: int) -> Shape:
        stored = read_shape(self._path, self._file, number)
        try:
            return decode(stored, self._views.records[number])
        except InvalidRecordError as e:
            raise _damaged_shape(self._path, number, e) from e


def _damaged_shape(path: Path, number: int, found: InvalidRecordError) -> DatabaseError:
    return damaged(path, f"view {number + 1} with {found}", "a rooted graph and its outline")
