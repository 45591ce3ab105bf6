"""A disk that forgets what was not synced: made from what `forgetful.c` wrote down of a program.

When the power goes, of each file what was written since its last sync may be there or not, write by
write; so may new names, renames and removals since the last sync of their folder.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

SHIM = Path(__file__).with_name("forgetful.c")


def compiled_shim(folder: Path) -> Path | None:
    """The library to preload, or None where no compiler is."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    library = folder / "forgetful.so"
    made = subprocess.run(
        [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(SHIM), "-ldl"],
        capture_output=True,
        check=False,
    )
    return library if made.returncode == 0 else None


@dataclass(frozen=True, slots=True)
class Operation:
    """One line of the record."""

    what: str
    path: str
    at: int
    data: bytes


def operations(record: Path) -> Iterator[Operation]:
    """What a program did, in order."""
    with record.open("rb") as file:
        while line := file.readline():
            what, path, at, size = line.decode().split(" ")
            yield Operation(what, path, int(at), file.read(int(size)))


@dataclass
class _File:
    """What is on the disk for sure, and what may be."""

    safe: bytearray = field(default_factory=bytearray)
    loose: list[Operation] = field(default_factory=list)

    def after(self, rng: random.Random | None) -> bytearray:
        """Its bytes once the power was lost; with all that is loose when there is no chance."""
        data = bytearray(self.safe)
        for operation in self.loose:
            if rng is None or rng.random() < 0.5:
                _apply(data, operation)
        return data


def _apply(data: bytearray, operation: Operation) -> None:
    if operation.what == "truncate":
        del data[operation.at :]
        data.extend(bytes(operation.at - len(data)))
    else:
        data.extend(bytes(max(0, operation.at - len(data))))
        data[operation.at : operation.at + len(operation.data)] = operation.data


class ForgetfulDisk:
    """What stands on a disk as a program goes on."""

    def __init__(self) -> None:
        self._inodes: dict[str, _File] = {}  # as the program sees them
        self._names: dict[str, _File] = {}  # as the disk has them for sure

    def do(self, operation: Operation) -> None:
        """Take up one operation."""
        path = operation.path
        if operation.what == "unlink":
            self._inodes.pop(path, None)
        elif operation.what == "rename":
            self._inodes[operation.data.decode()] = self._inodes.pop(path, _File())
        elif operation.what == "sync":
            self._sync(path)
        else:
            self._inodes.setdefault(path, _File()).loose.append(operation)

    def _sync(self, path: str) -> None:
        file = self._inodes.get(path)
        if file is not None:
            file.safe, file.loose = file.after(None), []
            return
        below = {p: f for p, f in self._inodes.items() if os.path.dirname(p) == path}  # noqa: PTH120
        gone = [p for p in self._names if os.path.dirname(p) == path]  # noqa: PTH120
        for name in gone:
            del self._names[name]
        self._names |= below

    def lose_power(self, rng: random.Random) -> dict[str, bytes]:
        """What is there when the power is back: path -> bytes."""
        names = {}
        for path in self._inodes.keys() | self._names.keys():
            sure, seen = self._names.get(path), self._inodes.get(path)
            file = sure if sure is seen or rng.random() < 0.5 else seen
            if file is not None:
                names[path] = bytes(file.after(rng))
        return names
