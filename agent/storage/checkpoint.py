"""Serialises the state of an agent: minds, memories of reasoners, states of behaviours.

A state is a graph of plain values, NumPy arrays and objects of visup's own classes, whose shared references
are preserved. Reading it cannot run code of the file's choosing: nothing is imported, only classes that visup
has already loaded are instantiated, and only by setting their attributes.
"""

from __future__ import annotations

import json
import struct
import sys
import zlib
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from types import FunctionType, MappingProxyType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import OutputError

MAGIC = b"VISUPSTA"
PACKAGE = "visup."
_HEAD = struct.Struct(
    "<8sQII"
)  # magic, size of the tree in bytes, checksums of the tree and of the arrays
_PLAIN = frozenset({type(None), bool, int, float, str})
_Node = Any


class StateError(TypeError):
    """A value has a type that cannot be saved."""


def dump_state(value: Any) -> bytes:
    """Serialise a state.

    Raises:
        StateError: It contains something that cannot be saved, such as a function or an open file.
    """
    writer = _StateWriter()
    root = writer.node(value)
    tree = json.dumps([writer.table, root, writer.shapes], separators=(",", ":")).encode()
    body = b"".join(writer.arrays)
    return _HEAD.pack(MAGIC, len(tree), zlib.crc32(tree), zlib.crc32(body)) + tree + body


def load_state(data: bytes) -> Any:
    """Deserialise a state.

    Raises:
        OutputError: The bytes are damaged, or of another version of visup.
    """
    try:
        magic, size, tree_crc, body_crc = _HEAD.unpack_from(data)
        tree = data[_HEAD.size : _HEAD.size + size]
        body = memoryview(data)[_HEAD.size + size :]
        if magic != MAGIC or zlib.crc32(tree) != tree_crc or zlib.crc32(body) != body_crc:
            raise ValueError("its check sum is wrong")
        table, root, shapes = json.loads(tree)
        return _StateReader(table, _arrays(shapes, body)).value(root)
    except (struct.error, ValueError, TypeError, KeyError, IndexError, AttributeError) as fault:
        raise OutputError(f"a saved state cannot be read ({fault})") from fault


@dataclass(slots=True)
class _StateWriter:
    """Builds a table of nodes in which each comes after those that it refers to."""

    table: list[_Node] = field(default_factory=list)
    shapes: list[tuple[str, list[int], str]] = field(default_factory=list)
    arrays: list[bytes] = field(default_factory=list)
    _known: dict[int, int] = field(default_factory=dict)
    _alive: list[Any] = field(default_factory=list)  # keeps ids unique

    def node(self, value: Any) -> _Node:
        """A plain value unchanged, anything else as [its number in the table]."""
        if type(value) in _PLAIN:
            return value
        number = self._known.get(id(value))
        if number == _OPEN:
            raise StateError(f"{type(value).__qualname__} holds itself")
        if number is None:
            self._known[id(value)] = _OPEN
            self._alive.append(value)
            node = self._made(value)
            number = self._known[id(value)] = len(self.table)
            self.table.append(node)
        return [number]

    def _made(self, value: Any) -> _Node:
        kind = type(value)
        if kind is tuple or kind is list:
            return [kind.__name__, [self.node(v) for v in value]]
        if kind is deque:
            return ["deque", value.maxlen, [self.node(v) for v in value]]
        if kind is frozenset or kind is set:
            return [kind.__name__, [self.node(v) for v in _in_order(value)]]
        if kind is dict or kind is MappingProxyType:
            pairs = [[self.node(k), self.node(v)] for k, v in value.items()]
            return ["dict" if kind is dict else "frozendict", pairs]
        if kind is np.ndarray or isinstance(value, np.generic):
            return ["array" if kind is np.ndarray else "scalar", self._array(value)]
        if isinstance(value, Path):
            return ["path", str(value)]
        if kind is bytes:
            return ["bytes", self._array(np.frombuffer(value, np.uint8))]
        if kind.__qualname__ == "csr_matrix" and kind.__module__.startswith("scipy.sparse"):
            parts = (value.data, value.indices, value.indptr, value.shape)
            return ["csr", *(self.node(p) for p in parts)]
        name = _name(kind)
        if isinstance(value, Enum):
            return ["enum", name, self.node(value.value)]
        if isinstance(value, tuple):
            return ["named", name, [self.node(v) for v in value]]
        if isinstance(value, str):  # a name in a task, which has a position
            return [
                "text",
                name,
                str(value),
                [[n, self.node(v)] for n, v in state_of(value).items()],
            ]
        if isinstance(value, _BUILT_IN):
            raise StateError(f"a {kind.__qualname__}")
        return ["object", name, [[n, self.node(v)] for n, v in state_of(value).items()]]

    def _array(self, value: NDArray[Any] | np.generic) -> int:
        array = np.asarray(value)
        if array.dtype.kind not in "biufc":
            raise StateError(f"an array of {array.dtype}")
        # The memory order affects sums in the last bits.
        order = "F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C"
        self.shapes.append((array.dtype.str, list(array.shape), order))
        self.arrays.append(array.tobytes(order))  # type: ignore[arg-type]  # 'C' or 'F'
        return len(self.arrays) - 1


_OPEN = -1
_BUILT_IN = (bool, int, float, str, bytes, list, dict, set, frozenset)


def _in_order(values: frozenset[Any] | set[Any]) -> list[Any]:
    try:
        return sorted(values)
    except TypeError:
        return sorted(values, key=repr)


def _name(kind: type) -> str:
    if not kind.__module__.startswith(PACKAGE) or "<locals>" in kind.__qualname__:
        raise StateError(f"a {kind.__module__}.{kind.__qualname__}")
    return f"{kind.__module__}:{kind.__qualname__}"


def state_of(value: Any) -> dict[str, Any]:
    """The attributes of an object, including those in slots.

    Raises:
        StateError: It has no plain attributes.
    """
    if isinstance(value, FunctionType | ModuleType | type):
        raise StateError(f"a {type(value).__qualname__}")
    slots = [n for k in type(value).__mro__ for n in getattr(k, "__slots__", ())]
    found = {n: getattr(value, n) for n in slots if n[:2] != "__" and hasattr(value, n)}
    return {**found, **getattr(value, "__dict__", {})}


def loaded_modules(data: bytes) -> list[str]:
    """The modules of the classes in a state, so that another process can load them first."""
    _, size, _, _ = _HEAD.unpack_from(data)
    table, _, _ = json.loads(data[_HEAD.size : _HEAD.size + size])
    named = {node[1] for node in table if node[0] in ("object", "enum", "named", "text")}
    return sorted({name.partition(":")[0] for name in named})


@dataclass(slots=True)
class _StateReader:
    table: list[_Node]
    arrays: list[NDArray[Any]]
    _made: list[Any] = field(default_factory=list)

    def value(self, root: _Node) -> Any:
        for kind, *parts in self.table:
            self._made.append(_MAKERS[kind](self, *parts))
        return self._of(root)

    def _of(self, node: _Node) -> Any:
        return self._made[node[0]] if type(node) is list else node

    def many(self, nodes: list[_Node]) -> list[Any]:
        return [self._of(n) for n in nodes]

    def pairs(self, nodes: list[tuple[_Node, _Node]]) -> dict[Any, Any]:
        return {self._of(k): self._of(v) for k, v in nodes}

    def made(self, name: str, attributes: list[tuple[str, _Node]]) -> Any:
        record: Any = object.__new__(_class(name))
        for attribute, node in attributes:
            object.__setattr__(record, attribute, self._of(node))
        return record

    def named(self, name: str, nodes: list[_Node]) -> Any:
        kind = _class(name)
        if not issubclass(kind, tuple):
            raise ValueError(f"{name} is not a tuple")
        return tuple.__new__(kind, self.many(nodes))

    def text(self, name: str, text: str, attributes: list[tuple[str, _Node]]) -> Any:
        kind = _class(name)
        if not issubclass(kind, str) or issubclass(kind, Enum):
            raise ValueError(f"{name} is not a text")
        instance = str.__new__(kind, text)
        for attribute, node in attributes:
            object.__setattr__(instance, attribute, self._of(node))
        return instance

    def csr(self, *parts: _Node) -> Any:
        from scipy.sparse import csr_matrix

        data, indices, starts, shape = self.many(list(parts))
        return csr_matrix((data, indices, starts), shape=shape)

    def enum(self, name: str, node: _Node) -> Any:
        kind = _class(name)
        if not issubclass(kind, Enum):
            raise ValueError(f"{name} is not an enumeration")
        return kind(self._of(node))


_MAKERS: Mapping[str, Callable[..., Any]] = {
    "tuple": lambda r, nodes: tuple(r.many(nodes)),
    "list": lambda r, nodes: r.many(nodes),
    "deque": lambda r, most, nodes: deque(r.many(nodes), most),
    "set": lambda r, nodes: set(r.many(nodes)),
    "frozenset": lambda r, nodes: frozenset(r.many(nodes)),
    "dict": lambda r, nodes: r.pairs(nodes),
    "frozendict": lambda r, nodes: MappingProxyType(r.pairs(nodes)),
    "array": lambda r, number: r.arrays[number],
    "scalar": lambda r, number: r.arrays[number][()],
    "bytes": lambda r, number: r.arrays[number].tobytes(),
    "object": _StateReader.made,
    "path": lambda r, text: Path(text),
    "enum": _StateReader.enum,
    "csr": _StateReader.csr,
    "named": _StateReader.named,
    "text": _StateReader.text,
}


def _class(name: str) -> type:
    module, _, path = name.partition(":")
    if not module.startswith(PACKAGE):
        raise ValueError(f"{name} is not visup's")
    found: Any = sys.modules[module]
    for part in path.split("."):
        found = vars(found)[part]
    if not isinstance(found, type) or found.__module__ != module:
        raise ValueError(f"{name} is not a class")
    return found


def _arrays(shapes: list[tuple[str, list[int], str]], body: memoryview) -> list[NDArray[Any]]:
    found, offset = [], 0
    for dtype_name, shape, order in shapes:
        dtype = np.dtype(dtype_name)
        if dtype.kind not in "biufc":
            raise ValueError(f"an array of {dtype}")
        count = int(np.prod(shape, dtype=np.int64))
        flat = np.frombuffer(body, dtype, count, offset).copy()
        found.append(flat.reshape(shape, order="F" if order == "F" else "C"))
        offset += flat.nbytes
    return found
