"""A lake: a folder with the tables of many runs, and their journals.

A run is committed by the file of its row in `runs`, which is written last. Any other file of a run
without that row (its writer was killed, the disk was full) is not part of the lake: readers ignore it, and
writing the run again replaces the same files. So nothing is lost or duplicated, wherever a writer stops.
"""

from __future__ import annotations

import heapq
import json
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import replacing, write_atomically
from visup.agent.storage.journal import segments
from visup.agent.storage.journal_reader import JOURNAL, Recording, opened_readonly
from visup.archive.extra import imported
from visup.archive.inputs import RunInputs, with_inputs
from visup.archive.joining.manifest import FOLDER, MAX_RUNS, Partition, read_manifest
from visup.archive.run_tables import RunTables
from visup.archive.schema import SCHEMA_VERSION, TABLES
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings

MARK = "lake.json"
TABLES_FOLDER = "tables"
RECORDINGS = "recordings"
BELIEFS = "beliefs.npz"
"""Next to the journal of a run: saved beliefs for fast evaluation of conditions about relations."""
SCHEMA_FILE = "schema.parquet"
"""In the folder of a table: a file without rows, so that the table exists before its first row."""


@dataclass(frozen=True, slots=True)
class LakeSnapshot:
    """The runs of a lake at one time, and their files.

    Attributes:
        path: Folder of the lake.
        partitions: The active partitions.
        loose: Keys of the unjoined runs, sorted.
        files: Table -> its files, at least one, perhaps without rows.
    """

    path: Path
    partitions: tuple[Partition, ...]
    loose: tuple[str, ...]
    files: Mapping[str, Sequence[Path]]

    def index_files(self, name: str) -> list[Path]:
        """The index files of that name, one per partition."""
        return [self.path / FOLDER / part.name / f"{name}.parquet" for part in self.partitions]

    def numbered(self) -> Iterator[tuple[tuple[str, ...], int, bool]]:
        """Runs with consecutive numbers in the index, the first number, and whether they are unjoined."""
        yield from ((part.runs, part.run_number(0), False) for part in self.partitions)
        first = max((part.run_number(MAX_RUNS) for part in self.partitions), default=0)
        yield self.loose, first, True


@dataclass(frozen=True, slots=True)
class Lake:
    """A lake on disk.

    Attributes:
        path: Its folder.
        fetch: Downloads the journal of a run into its folder, for a lake in a store; or None.
    """

    path: Path
    fetch: Callable[[str, Path], None] | None = None

    @classmethod
    def open(cls, path: Path) -> Lake:
        """Open an existing lake.

        Raises:
            OutputError: There is none, or it is of another version.
        """
        try:
            mark = json.loads((path / MARK).read_text(encoding="utf-8"))
            version = mark["version"]
        except FileNotFoundError:
            raise OutputError(
                "there is no lake here",
                where=str(path),
                hint=f"visup archive run CLIPS... --into {path}",
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as fault:
            raise OutputError(f"this is not a lake ({fault})", where=str(path)) from fault
        if version != SCHEMA_VERSION:
            raise OutputError(
                f"this lake has version {version}",
                where=str(path),
                expected=f"version {SCHEMA_VERSION}",
                hint="fill a new lake with this visup, or read it with the visup that wrote it",
            )
        return cls(path)

    @classmethod
    def create(cls, path: Path) -> Lake:
        """Open a lake, or create one in a new or empty folder.

        Raises:
            OutputError: The folder holds something else, or cannot be written.
        """
        if (path / MARK).exists():
            return cls.open(path)
        lake = cls(path)
        begun = (
            TABLES_FOLDER,
            RECORDINGS,
            f".{MARK}",
        )  # left by a process killed before it wrote the mark
        try:
            if path.exists() and any(not p.name.startswith(begun) for p in path.iterdir()):
                raise OutputError(
                    "the folder holds something that is no lake",
                    where=str(path),
                    hint="choose a new folder",
                )
            for table in TABLES:
                lake._write_table(lake._table_folder(table) / SCHEMA_FILE, table, [])
            mark = {"format": "visup lake", "version": SCHEMA_VERSION}
            write_atomically(path / MARK, (json.dumps(mark) + "\n").encode())
        except OSError as fault:
            raise _unwritable(path, fault) from fault
        return lake

    def has(self, run: str) -> bool:
        """Whether a run is committed."""
        return self.table_file("runs", run).is_file() or run in read_manifest(self.path).runs

    def runs(self) -> list[str]:
        """The keys of all committed runs, sorted."""
        unjoined = {f.stem for f in self._unjoined_files("runs")}
        return sorted(unjoined | read_manifest(self.path).runs)

    def snapshot(self) -> LakeSnapshot:
        """The present runs and their files; later changes do not affect it."""
        unjoined = {
            f.stem for f in self._unjoined_files("runs")
        }  # before the manifest, so that no run is missed between the two
        manifest = read_manifest(self.path)
        loose = unjoined - manifest.runs
        return LakeSnapshot(
            self.path,
            manifest.partitions,
            tuple(sorted(loose)),
            {
                table: [
                    self._table_folder(table) / SCHEMA_FILE,
                    *(self._joined_file(part, table) for part in manifest.partitions),
                    *(f for f in (self._unjoined_files(table) if loose else ()) if f.stem in loose),
                ]
                for table in TABLES
            },
        )

    def commit(
        self, tables: RunTables, recording: Recording, inputs: RunInputs, beliefs: bytes = b""
    ) -> bool:
        """Add a run atomically.

        Args:
            tables: Its rows, from `run_tables`.
            recording: Its journal.
            inputs: Its input files.
            beliefs: Content of `BeliefRecorder`, or empty.

        Returns:
            Whether it was added; False if the lake has it already.

        Raises:
            OutputError: It cannot be written, or the journal cannot be read.
        """
        run = str(tables["runs"][0][0])
        if self.has(run):
            return False
        try:
            self._save(self.folder_of(run), recording, inputs)
            if beliefs:
                write_atomically(self.folder_of(run) / BELIEFS, beliefs)
            for table in sorted(TABLES, key=lambda name: name == "runs"):  # `runs` last: it commits
                if tables[table]:
                    self._write_table(self.table_file(table, run), table, tables[table])
        except (OSError, sqlite3.Error) as fault:
            raise _unwritable(self.path, fault) from fault
        return True

    def folder_of(self, run: str) -> Path:
        """The folder with the journal and the input files of a run."""
        return self.path / RECORDINGS / run[:2] / run

    def recorded(self, run: str) -> tuple[Recording, WatchSettings]:
        """The journal of a run, and its settings with the saved input files.

        Raises:
            OutputError: They are missing or damaged.
        """
        folder = self.folder_of(run)
        if self.fetch:
            self.fetch(run, folder)
        recording = Recording.open(folder)
        settings = recorded_settings(recording.facts(), str(recording.path))
        return recording, with_inputs(settings, folder)

    def files(self, table: str) -> list[Path]:
        """The files of a table, including those of uncommitted runs."""
        return sorted(self._table_folder(table).rglob("*.parquet"))

    def rows(self, table: str) -> Iterator[Mapping[str, Any]]:
        """All rows of a table, sorted by the keys of their runs.

        Raises:
            OutputError: A file is damaged.
            ExtraMissingError: pyarrow is not installed.
        """
        found = self.snapshot()
        joined = (self._read(self._joined_file(part, table)) for part in found.partitions)
        files = (self.table_file(table, run) for run in found.loose)
        unjoined = (row for file in files if file.is_file() for row in self._read(file))
        # Sorting is stable: the rows of a run keep their order.
        parts = (iter(sorted(rows, key=lambda row: str(row["run"]))) for rows in joined)
        yield from heapq.merge(*parts, unjoined, key=lambda row: str(row["run"]))

    def table_file(self, table: str, run: str) -> Path:
        """The path of a run's own file of a table."""
        return self._table_folder(table) / run[:2] / f"{run}.parquet"

    def _joined_file(self, part: Partition, table: str) -> Path:
        return self.path / FOLDER / part.name / f"{table}.parquet"

    def _unjoined_files(self, table: str) -> Iterator[Path]:
        return self._table_folder(table).glob("??/*.parquet")

    def _read(self, file: Path) -> list[dict[str, Any]]:
        try:
            rows: list[dict[str, Any]] = (
                imported("pyarrow.parquet").read_table(file, partitioning=None).to_pylist()
            )
            return rows
        except (OSError, imported("pyarrow").ArrowInvalid) as fault:
            message = f"the table cannot be read ({fault})"
            raise OutputError(message, where=str(file)) from fault

    def _table_folder(self, table: str) -> Path:
        return self.path / TABLES_FOLDER / table

    def _write_table(self, file: Path, table: str, rows: list[tuple[Any, ...]]) -> None:
        arrow, parquet = imported("pyarrow"), imported("pyarrow.parquet")
        schema = TABLES[table].arrow(arrow)
        columns = list(zip(*rows, strict=True)) or [()] * len(schema)
        arrays = [
            arrow.array(_seconds(c) if f.type == arrow.timestamp("us", "UTC") else c, f.type)
            for c, f in zip(columns, schema, strict=True)
        ]
        file.parent.mkdir(parents=True, exist_ok=True)
        with replacing(file) as draft:
            parquet.write_table(
                arrow.Table.from_arrays(arrays, schema=schema), draft, compression="zstd"
            )

    def _save(self, folder: Path, recording: Recording, inputs: RunInputs) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in inputs.files().items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_atomically(folder / name, content)
        for number, path in enumerate(segments(recording.path), 1):
            name = JOURNAL if number == 1 else f"{Path(JOURNAL).stem}-{number}.sqlite"
            with replacing(folder / name) as draft:
                _copy_database(path, draft)


def _copy_database(source: Path, target: Path) -> None:
    """Copy a journal including its write-ahead log."""
    with (
        closing(opened_readonly(source)) as old,
        closing(sqlite3.connect(target)) as new,
    ):
        old.backup(new)
        new.execute("PRAGMA journal_mode=DELETE")


def _seconds(column: tuple[Any, ...]) -> list[int | None]:
    """Seconds since the epoch as microseconds."""
    return [None if t is None else round(t * 1e6) for t in column]


def _unwritable(path: Path, fault: Exception) -> OutputError:
    reason = getattr(fault, "strerror", None) or str(fault)
    return OutputError(
        f"the lake cannot be written ({reason})",
        where=str(path),
        hint="check that the folder may be written and has room",
    )
