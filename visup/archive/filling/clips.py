"""Clips: expands the sources that a user names."""

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
MAX_MANIFEST_BYTES = 128 * 2**20
SEQUENCE_FOLDERS = ("img1", "frames")
"""A folder with one of these is a sequence of images in the layout of MOT or DAVIS."""
_RESERVED_COLUMNS = ("source", "task", "actor", "taken")
Row = Mapping[str | None, str | None]


@dataclass(frozen=True, slots=True)
class Clip:
    """One source with its metadata.

    Attributes:
        source: A video file, a folder of images, or a file in a store.
        tasks: Its tasks; if empty, those of the command.
        actors: Actor -> models; if empty, those of the command.
        taken: When it was recorded, seconds since the epoch; None for the time of its file.
        labels: Further columns of the manifest.
    """

    source: Path | StoredFile
    tasks: tuple[str, ...] = ()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    taken: float | None = None
    labels: Mapping[str, str] = field(default_factory=dict)


def clips_of(sources: Iterable[str]) -> list[Clip]:
    """The clips that the sources name, in order and without duplicates, with the metadata of manifests.

    Args:
        sources: Files; folders of images; folders, searched recursively for clips; patterns
            with `*`, `?`, `[...]`, and `**` for any depth; manifests (`.csv`, `.parquet`); URLs of stores.

    Raises:
        SourceError: A source names no clip, or a manifest is not valid.
    """
    found: dict[Path | StoredFile, Clip] = {}
    for word in sources:
        for clip in _clips_named(word):
            if found.get(clip.source, bare := Clip(clip.source)) == bare:
                found[clip.source] = clip
    return list(found.values())


def _clips_named(word: str) -> list[Clip]:
    if is_url(word):
        return [Clip(stored) for stored in stored_clips(word)]
    path = Path(word).expanduser()
    if path.suffix.lower() in MANIFESTS and path.is_file():
        return list(_manifest(path))
    if path.exists():
        clips = [Clip(p) for p in _below(path.absolute(), explicit=True)]
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


def _below(path: Path, *, explicit: bool = False) -> Iterator[Path]:
    """The path itself, or the clips in a folder; a file named explicitly is a clip whatever its suffix."""
    if path.is_file():
        if explicit or path.suffix.lower() in VIDEO_SUFFIXES:
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
    """The rows of a manifest with their line numbers; the header is checked even without rows."""
    try:
        reader = csv.DictReader(StringIO(read_text_file(path, MAX_MANIFEST_BYTES)), strict=True)
        if "source" not in (reader.fieldnames or ()):
            yield 1, {}
        yield from ((reader.line_num, row) for row in reader)
    except UnicodeDecodeError:
        raise SourceError("this is not text", where=str(path), expected="CSV in UTF-8") from None
    except (OSError, csv.Error) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise SourceError(f"the manifest cannot be read ({reason})", where=str(path)) from fault


def _parquet_rows(path: Path) -> Iterator[tuple[int, Row]]:
    """The rows of a manifest with their numbers; lists correspond to values separated by `;` in CSV."""
    try:
        table = imported("pyarrow.parquet").read_table(path, partitioning=None)
    except (OSError, imported("pyarrow").ArrowInvalid) as fault:
        raise SourceError(f"the manifest cannot be read ({fault})", where=str(path)) from fault
    if "source" not in table.column_names:
        yield 1, {}
    for number, row in enumerate(table.to_pylist(), 1):
        yield number, {name: _text(value) for name, value in row.items()}


def _text(value: Any) -> str:
    """A Parquet value as the text that CSV would have."""
    if isinstance(value, list):
        return ";".join(map(_text, value))
    return "" if value is None else str(value)


def _clip(row: Row, manifest: Path, line: int) -> Clip:
    where = f"{manifest}:{line}"
    fields = {str(k): (v or "").strip() for k, v in row.items() if k is not None}
    if None in row:
        raise SourceError("the line has more fields than the head", where=where)
    source = _source(fields["source"], manifest.absolute().parent, where)
    tasks = tuple(_task(t, manifest) for t in _parts(fields.get("task", "")))
    labels = {k: v for k, v in fields.items() if k not in _RESERVED_COLUMNS and v}
    actors = parse_actors(_parts(fields.get("actor", "")))
    return Clip(source, tasks, actors, _taken(fields.get("taken", ""), where), labels)


def _source(fields: str, folder: Path, where: str) -> Path | StoredFile:
    if is_url(fields):
        return stored_clips(fields)[0]
    source = folder / Path(fields).expanduser()
    if not fields or not source.exists():
        raise SourceError(
            "there is no such clip", where=where, expected="a path from the folder of the manifest"
        )
    return source


def _parts(text: str) -> list[str]:
    return [p.strip() for p in text.split(";") if p.strip()]


def _task(name: str, manifest: Path) -> str:
    """A task file next to the manifest, or the name unchanged: a shipped task or another path."""
    neighbour = manifest.absolute().parent / name
    return str(neighbour) if neighbour.exists() else name


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
