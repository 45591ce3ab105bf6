"""Clips: the sources that a user named, one by one."""

from __future__ import annotations

import csv
import glob
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SourceError
from visup.agent.storage.text_file import read_text_file
from visup.archive.extra import imported
from visup.archive.filling.stores import StoredFile, is_url, stored_clips
from visup.percepts.video.image_folder import IMAGE_SUFFIXES, VIDEO_SUFFIXES
from visup.percepts.video.ros_bag import is_bag
from visup.runs.settings import parse_actors

PARQUET = ".parquet"
MANIFESTS = (".csv", PARQUET)
LARGEST_MANIFEST_BYTES = 128 * 2**20
SEQUENCE_FOLDERS = ("img1", "frames")
"""In a folder with one of these, images are a sequence in the layout of MOT or DAVIS."""
_OWN = ("source", "task", "actor", "taken")
Row = Mapping[str | None, str | None]


@dataclass(frozen=True, slots=True)
class Clip:
    """One source with what is known of it.

    Attributes:
        source: A video file, a folder of images, or a file in a store.
        tasks: What it is watched for; those of the command where empty.
        actors: Actor -> models; those of the command where empty.
        taken: When it was made, seconds since the epoch; None for the time of its file.
        labels: Whatever else the manifest says of it.
    """

    source: Path | StoredFile
    tasks: tuple[str, ...] = ()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    taken: float | None = None
    labels: Mapping[str, str] = field(default_factory=dict)


def clips_of(sources: Iterable[str]) -> list[Clip]:
    """The clips that some words name, in their order, each once, with what a manifest says of them.

    Args:
        sources: Files; folders of images; folders in which clips are looked for, also further down; patterns
            with `*`, `?`, `[...]`, and `**` for any depth; manifests (`.csv`, `.parquet`); URLs of stores.

    Raises:
        SourceError: A word names no clip, or a manifest is not as it should be.
    """
    found: dict[Path | StoredFile, Clip] = {}
    for word in sources:
        for clip in _named(word):
            if found.get(clip.source, bare := Clip(clip.source)) == bare:
                found[clip.source] = clip
    return list(found.values())


def _named(word: str) -> list[Clip]:
    if is_url(word):
        return [Clip(stored) for stored in stored_clips(word)]
    path = Path(word).expanduser()
    if path.suffix.lower() in MANIFESTS and path.is_file():
        return list(_manifest(path))
    if path.exists():
        clips = [Clip(p) for p in _below(path.absolute(), named=True)]
    else:
        hits = sorted(glob.glob(str(path), recursive=True)) if glob.has_magic(word) else []  # noqa: PTH207
        clips = [Clip(p) for hit in hits for p in _below(Path(hit).absolute())]
    if not clips:
        raise SourceError(
            "no clip is found here",
            where=word,
            expected="a video file, a folder of images, a folder with clips, a pattern, "
            "a manifest (.csv, .parquet) or a URL",
        )
    return clips


def _below(path: Path, *, named: bool = False) -> Iterator[Path]:
    """A clip itself, or the clips in a folder; a file that was named is one, whatever it is called."""
    if path.is_file():
        if named or path.suffix.lower() in VIDEO_SUFFIXES:
            yield path
    elif _is_sequence(path):
        yield path
    elif path.is_dir():
        for entry in sorted(path.iterdir()):
            if not entry.name.startswith("."):
                yield from _below(entry)


def _is_sequence(folder: Path) -> bool:
    if not folder.is_dir():
        return False
    return (
        is_bag(folder)
        or any((folder / name).is_dir() for name in SEQUENCE_FOLDERS)
        or any(p.suffix.lower() in IMAGE_SUFFIXES for p in folder.iterdir())
    )


def _manifest(path: Path) -> Iterator[Clip]:
    for line, row in _parquet_rows(path) if path.suffix.lower() == PARQUET else _csv_rows(path):
        if "source" not in row:
            raise SourceError(
                "the manifest has no column `source`",
                where=str(path),
                expected="columns such as: source,task,actor,taken",
            )
        yield _clip(row, path, line)


def _csv_rows(path: Path) -> Iterator[tuple[int, Row]]:
    """The rows of a manifest with their lines; one without rows still has its head looked at."""
    try:
        reader = csv.DictReader(StringIO(read_text_file(path, LARGEST_MANIFEST_BYTES)), strict=True)
        if "source" not in (reader.fieldnames or ()):
            yield 1, {}
        yield from ((reader.line_num, row) for row in reader)
    except UnicodeDecodeError:
        raise SourceError("this is not text", where=str(path), expected="CSV in UTF-8") from None
    except (OSError, csv.Error) as fault:
        said = getattr(fault, "strerror", None) or fault
        raise SourceError(f"the manifest cannot be read ({said})", where=str(path)) from fault


def _parquet_rows(path: Path) -> Iterator[tuple[int, Row]]:
    """The rows of a manifest with their numbers; lists are what `;` separates in CSV."""
    try:
        table = imported("pyarrow.parquet").read_table(path, partitioning=None)
    except (OSError, imported("pyarrow").ArrowInvalid) as fault:
        raise SourceError(f"the manifest cannot be read ({fault})", where=str(path)) from fault
    if "source" not in table.column_names:
        yield 1, {}
    for number, row in enumerate(table.to_pylist(), 1):
        yield number, {name: _text(value) for name, value in row.items()}


def _text(value: Any) -> str:
    """A value of Parquet as CSV would have it."""
    if isinstance(value, list):
        return ";".join(map(_text, value))
    return "" if value is None else str(value)


def _clip(row: Row, manifest: Path, line: int) -> Clip:
    where = f"{manifest}:{line}"
    told = {str(k): (v or "").strip() for k, v in row.items() if k is not None}
    if None in row:
        raise SourceError("the line has more fields than the head", where=where)
    source = _source(told["source"], manifest.absolute().parent, where)
    tasks = tuple(_task(t, manifest) for t in _parts(told.get("task", "")))
    labels = {k: v for k, v in told.items() if k not in _OWN and v}
    actors = parse_actors(_parts(told.get("actor", "")))
    return Clip(source, tasks, actors, _taken(told.get("taken", ""), where), labels)


def _source(told: str, folder: Path, where: str) -> Path | StoredFile:
    if is_url(told):
        return stored_clips(told)[0]
    source = folder / Path(told).expanduser()
    if not told or not source.exists():
        raise SourceError(
            "there is no such clip", where=where, expected="a path from the folder of the manifest"
        )
    return source


def _parts(text: str) -> list[str]:
    return [p.strip() for p in text.split(";") if p.strip()]


def _task(name: str, manifest: Path) -> str:
    """A task file beside the manifest, or the name as it is: a shipped task, or a path of its own."""
    beside = manifest.absolute().parent / name
    return str(beside) if beside.exists() else name


def _taken(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise SourceError(
            f"'{text}' is no time", where=where, expected="ISO 8601, such as 2026-03-01T14:30:00Z"
        ) from None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
