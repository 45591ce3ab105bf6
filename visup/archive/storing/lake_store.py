"""A lake in an object store with a local copy.

The files of a run never change, so an existing file is up to date. A run is committed in the store as
locally: by the file of its row in `runs`, which is written last. Partitions are written before `joined.json`,
which names them. Journals are downloaded only when a run is opened.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import replacing, write_atomically
from visup.archive.extra import imported
from visup.archive.joining.manifest import FOLDER, MANIFEST, read_manifest
from visup.archive.lake import MARK, RECORDINGS, SCHEMA_FILE, TABLES_FOLDER, Lake
from visup.archive.schema import TABLES

COMMITS = f"{TABLES_FOLDER}/runs/"
PULLED = ".joined.pulled"
"""In a copy: the last `joined.json` read from the store."""


@dataclass(frozen=True, slots=True)
class LakeStore:
    """The store of a lake.

    Attributes:
        url: URL of its folder, without a trailing slash.
    """

    url: str

    def exists(self) -> bool:
        """Whether the store has a lake.

        Raises:
            OutputError: The store cannot be read.
        """
        with self._reached() as (store, root):
            return bool(store.exists(f"{root}/{MARK}"))

    def pull(self, copy: Path) -> None:
        """Download missing table files; the row in `runs` comes last for each run.

        Args:
            copy: Folder of the copy.

        Raises:
            OutputError: The store cannot be read, or the copy cannot be written.
        """
        with self._reached() as (store, root):
            remote = self._sizes(store, root)
            tables = [n for n in remote if n.startswith((f"{TABLES_FOLDER}/", f"{FOLDER}/"))]
            for name in sorted(tables, key=_commits_last):
                _download(store, f"{root}/{name}", copy / name, remote[name])
            joined = _content(store, f"{root}/{MANIFEST}") if MANIFEST in remote else b""
            write_atomically(copy / PULLED, joined)
            if joined:
                write_atomically(copy / MANIFEST, joined)
            if MARK in remote:
                write_atomically(copy / MARK, _content(store, f"{root}/{MARK}"))

    def fetch(self, run: str, folder: Path) -> None:
        """Download the journal of a run and the files saved with it.

        Args:
            run: Its key.
            folder: Its local folder.

        Raises:
            OutputError: The store cannot be read.
        """
        if folder.exists():
            return
        with self._reached() as (store, root):
            source = f"{root}/{RECORDINGS}/{run[:2]}/{run}"
            draft = folder.with_name(f".{folder.name}.part")
            for name, size in self._sizes(store, source).items():
                _download(store, f"{source}/{name}", draft / name, size)
            if draft.exists():
                draft.rename(folder)

    def push_run(self, lake: Lake, run: str) -> None:
        """Upload a locally committed run.

        Args:
            lake: The copy.
            run: Its key.

        Raises:
            OutputError: The store cannot be written; the run is then not committed in it.
        """
        with self._reached() as (store, root):
            _upload_all(store, root, lake.path, _files_of(lake, run))

    def push(self, lake: Lake) -> None:
        """Upload runs and partitions that the store does not have.

        Args:
            lake: The copy.

        Raises:
            OutputError: The store cannot be written, or another process has joined files of this lake
                meanwhile.
        """
        with self._reached() as (store, root):
            remote_sizes = self._sizes(store, root)
            files = (f for f in _all_files(lake) if remote_sizes.get(_name(f, lake)) != _size(f))
            _upload_all(store, root, lake.path, files)
            self._push_manifest(store, root, lake, remote_sizes)

    def _push_manifest(
        self, store: Any, root: str, lake: Lake, remote_sizes: dict[str, int]
    ) -> None:
        """Update the manifest in the store, and delete there the replaced files that were deleted locally."""
        if not (lake.path / MANIFEST).exists():
            return
        local_manifest = (lake.path / MANIFEST).read_bytes()
        remote = _content(store, f"{root}/{MANIFEST}") if MANIFEST in remote_sizes else b""
        if remote not in (local_manifest, _read_or(lake.path / PULLED, b"")):
            raise OutputError(
                "another has joined files of this lake meanwhile",
                where=self.url,
                hint="run the same command again",
            )
        if remote != local_manifest:
            _upload(store, f"{root}/{MANIFEST}", local_manifest)
            write_atomically(lake.path / PULLED, local_manifest)
        manifest = read_manifest(lake.path)
        parts = {p.name for p in manifest.partitions} | set(manifest.retired)
        obsolete = [
            n
            for n in remote_sizes
            if _replaced(n, manifest.runs, parts) and not (lake.path / n).exists()
        ]
        for name in obsolete:
            store.rm_file(f"{root}/{name}")

    def _sizes(self, store: Any, root: str) -> dict[str, int]:
        """Relative path -> size in bytes of the files below a folder."""
        store.invalidate_cache()
        base = store._strip_protocol(root).rstrip("/")
        found = store.find(root, detail=True)
        return {
            str(path)[len(base) :].lstrip("/"): int(entry["size"]) for path, entry in found.items()
        }

    @contextmanager
    def _reached(self) -> Iterator[tuple[Any, str]]:
        """The file system and the path of the lake in it; its errors become `OutputError`."""
        try:
            store, root = imported("fsspec").core.url_to_fs(self.url)
            yield store, root
        except OutputError:
            raise
        except Exception as fault:  # store libraries raise any type, and may be missing
            hint = None
            if isinstance(fault, ImportError):
                hint = "install what the store needs: pip install s3fs"
            reason = str(fault) or type(fault).__name__
            message = f"the lake in the store cannot be read or written ({reason})"
            raise OutputError(message, where=self.url, hint=hint) from fault


def _all_files(lake: Lake) -> Iterator[Path]:
    """All committed local files: runs, partitions, schema files, the mark."""
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
    """The own files of a run."""
    yield from (f for f in (lake.table_file(table, run) for table in TABLES) if f.is_file())
    yield from _below(lake.folder_of(run))


def _replaced(name: str, runs: frozenset[str], parts: set[str]) -> bool:
    """Whether a file in the store is of a joined run, or of a partition not in the manifest."""
    path = Path(name)
    if path.parts[0] == FOLDER:
        return path.parts[1] not in parts
    return path.parts[0] == TABLES_FOLDER and path.stem in runs


def _below(folder: Path) -> Iterator[Path]:
    files = sorted(folder.rglob("*")) if folder.is_dir() else []
    return (f for f in files if f.is_file() and not f.name.startswith("."))


def _commits_last(name: str) -> tuple[bool, bool, str]:
    """Sort key: rows of `runs` after all other files, and the mark of a lake last."""
    return name == MARK, name.startswith(COMMITS), name


def _name(file: Path, lake: Lake) -> str:
    return file.relative_to(lake.path).as_posix()


def _upload_all(store: Any, root: str, lake: Path, files: Iterable[Path]) -> None:
    """Upload files, the committing ones last."""
    names = (f.relative_to(lake).as_posix() for f in files)
    for name in sorted(names, key=_commits_last):
        _upload(store, f"{root}/{name}", (lake / name).read_bytes())


def _download(store: Any, remote_path: str, local_path: Path, size: int) -> None:
    """Download a file atomically unless it exists."""
    if _size(local_path) == size:
        return
    local_path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(local_path) as draft:
        store.get_file(remote_path, str(draft))


def _upload(store: Any, remote_path: str, content: bytes) -> None:
    """Upload a file atomically, even to a store that shows partial files, such as a disk."""
    store.makedirs(remote_path.rpartition("/")[0], exist_ok=True)
    with store.transaction, store.open(remote_path, "wb") as file:
        file.write(content)


def _content(store: Any, remote_path: str) -> bytes:
    content: bytes = store.cat_file(remote_path)
    return content


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else -1


def _read_or(path: Path, default: bytes) -> bytes:
    return path.read_bytes() if path.is_file() else default
