"""A lake in a store, of which there is a copy on this machine.

The files of a run never change, so that a file which is there is as it should be. A run is committed in
the store as it is here: by the file of its row in `runs`, which is written after all others of it.
Partitions come before `joined.json`, which names them. Journals are brought here when a run is opened, and
not before.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import replacing, write_whole
from visup.archive.extra import imported
from visup.archive.joining.manifest import FOLDER, MANIFEST, read_manifest
from visup.archive.lake import MARK, RECORDINGS, SCHEMA_FILE, TABLES_FOLDER, Lake
from visup.archive.schema import TABLES

COMMITS = f"{TABLES_FOLDER}/runs/"
PULLED = ".joined.pulled"
"""In a copy: `joined.json` as it was in the store when it was last looked at."""


@dataclass(frozen=True, slots=True)
class LakeStore:
    """Where a lake is kept.

    Attributes:
        url: Of its folder, without a slash at the end.
    """

    url: str

    def exists(self) -> bool:
        """Whether there is a lake.

        Raises:
            OutputError: The store cannot be read.
        """
        with self._reached() as (store, root):
            return bool(store.exists(f"{root}/{MARK}"))

    def pull(self, copy: Path) -> None:
        """Bring the tables here, as far as they are not; of a run whose row is here all others are.

        Args:
            copy: Folder of the copy.

        Raises:
            OutputError: The store cannot be read, or the copy not be written.
        """
        with self._reached() as (store, root):
            theirs = self._sizes(store, root)
            tables = [n for n in theirs if n.startswith((f"{TABLES_FOLDER}/", f"{FOLDER}/"))]
            for name in sorted(tables, key=_commits_last):
                _bring(store, f"{root}/{name}", copy / name, theirs[name])
            joined = _content(store, f"{root}/{MANIFEST}") if MANIFEST in theirs else b""
            write_whole(copy / PULLED, joined)
            if joined:
                write_whole(copy / MANIFEST, joined)
            if MARK in theirs:
                write_whole(copy / MARK, _content(store, f"{root}/{MARK}"))

    def fetch(self, run: str, folder: Path) -> None:
        """Bring the journal of a run here, with all beside it.

        Args:
            run: Its key.
            folder: Where it is kept.

        Raises:
            OutputError: The store cannot be read.
        """
        if folder.exists():
            return
        with self._reached() as (store, root):
            source = f"{root}/{RECORDINGS}/{run[:2]}/{run}"
            draft = folder.with_name(f".{folder.name}.part")
            for name, size in self._sizes(store, source).items():
                _bring(store, f"{source}/{name}", draft / name, size)
            if draft.exists():
                draft.rename(folder)

    def push_run(self, lake: Lake, run: str) -> None:
        """Bring a run to the store that is committed here.

        Args:
            lake: The copy.
            run: Its key.

        Raises:
            OutputError: The store cannot be written; the run is not there then.
        """
        with self._reached() as (store, root):
            _send_all(store, root, lake.path, _files_of(lake, run))

    def push(self, lake: Lake) -> None:
        """Bring to the store what is committed here and not there, runs and partitions.

        Args:
            lake: The copy.

        Raises:
            OutputError: The store cannot be written, or another has joined files of this lake meanwhile.
        """
        with self._reached() as (store, root):
            known = self._sizes(store, root)
            files = (f for f in _all_files(lake) if known.get(_name(f, lake)) != _size(f))
            _send_all(store, root, lake.path, files)
            self._push_manifest(store, root, lake, known)

    def _push_manifest(self, store: Any, root: str, lake: Lake, known: dict[str, int]) -> None:
        """Name the partitions in the store, and take away there what they replaced and is gone here."""
        if not (lake.path / MANIFEST).exists():
            return
        ours = (lake.path / MANIFEST).read_bytes()
        theirs = _content(store, f"{root}/{MANIFEST}") if MANIFEST in known else b""
        if theirs not in (ours, _read_or(lake.path / PULLED, b"")):
            raise OutputError(
                "another has joined files of this lake meanwhile",
                where=self.url,
                hint="run the same command again",
            )
        if theirs != ours:
            _send(store, f"{root}/{MANIFEST}", ours)
            write_whole(lake.path / PULLED, ours)
        manifest = read_manifest(lake.path)
        parts = {p.name for p in manifest.partitions} | set(manifest.retired)
        gone = [
            n for n in known if _replaced(n, manifest.runs, parts) and not (lake.path / n).exists()
        ]
        for name in gone:
            store.rm_file(f"{root}/{name}")

    def _sizes(self, store: Any, root: str) -> dict[str, int]:
        """The files below a folder, by their path from there: how large each is, bytes."""
        store.invalidate_cache()
        base = store._strip_protocol(root).rstrip("/")
        found = store.find(root, detail=True)
        return {
            str(path)[len(base) :].lstrip("/"): int(told["size"]) for path, told in found.items()
        }

    @contextmanager
    def _reached(self) -> Iterator[tuple[Any, str]]:
        """The store, and the path of the lake in it; what goes wrong there is told in visup's words."""
        try:
            store, root = imported("fsspec").core.url_to_fs(self.url)
            yield store, root
        except OutputError:
            raise
        except (
            Exception
        ) as fault:  # stores raise what they like, and their libraries may be missing
            hint = None
            if isinstance(fault, ImportError):
                hint = "install what the store needs: pip install s3fs"
            said = str(fault) or type(fault).__name__
            what = f"the lake in the store cannot be read or written ({said})"
            raise OutputError(what, where=self.url, hint=hint) from fault


def _all_files(lake: Lake) -> Iterator[Path]:
    """The files of what is committed here: runs, partitions, the columns of tables, the mark."""
    joined = read_manifest(lake.path)
    for run in lake.snapshot().loose:
        yield from _files_of(lake, run)
    for run in joined.runs:
        yield from _below(lake.folder_of(run))
    for part in joined.partitions:
        yield from _below(lake.path / FOLDER / part.name)
    yield from (lake.path / TABLES_FOLDER).glob(f"*/{SCHEMA_FILE}")
    yield lake.path / MARK


def _files_of(lake: Lake, run: str) -> Iterator[Path]:
    """The files of a run of its own."""
    yield from (f for f in (lake.table_file(table, run) for table in TABLES) if f.is_file())
    yield from _below(lake.folder_of(run))


def _replaced(name: str, runs: frozenset[str], parts: set[str]) -> bool:
    """Whether a file of the store is of a run that is joined, or of a partition that nobody names."""
    path = Path(name)
    if path.parts[0] == FOLDER:
        return path.parts[1] not in parts
    return path.parts[0] == TABLES_FOLDER and path.stem in runs


def _below(folder: Path) -> Iterator[Path]:
    files = sorted(folder.rglob("*")) if folder.is_dir() else []
    return (f for f in files if f.is_file() and not f.name.startswith("."))


def _commits_last(name: str) -> tuple[bool, bool, str]:
    """Rows of `runs` after all else, and the mark of a lake last of all."""
    return name == MARK, name.startswith(COMMITS), name


def _name(file: Path, lake: Lake) -> str:
    return file.relative_to(lake.path).as_posix()


def _send_all(store: Any, root: str, lake: Path, files: Iterable[Path]) -> None:
    """Write files, those last that commit the others."""
    names = (f.relative_to(lake).as_posix() for f in files)
    for name in sorted(names, key=_commits_last):
        _send(store, f"{root}/{name}", (lake / name).read_bytes())


def _bring(store: Any, there: str, here: Path, size: int) -> None:
    """Copy a file here, unless it is here already; it is there whole or not at all."""
    if _size(here) == size:
        return
    here.parent.mkdir(parents=True, exist_ok=True)
    with replacing(here) as draft:
        store.get_file(there, str(draft))


def _send(store: Any, there: str, content: bytes) -> None:
    """Write a file whole or not at all: also where a store shows what is half written, such as a disk."""
    store.makedirs(there.rpartition("/")[0], exist_ok=True)
    with store.transaction, store.open(there, "wb") as file:
        file.write(content)


def _content(store: Any, there: str) -> bytes:
    content: bytes = store.cat_file(there)
    return content


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else -1


def _read_or(path: Path, default: bytes) -> bytes:
    return path.read_bytes() if path.is_file() else default
