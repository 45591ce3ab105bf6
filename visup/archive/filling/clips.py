"""Clips: the sources that a user named, one by one."""

from __future__ import annotations

import csv
import glob
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path

from visup.agent.model.errors import SourceError
from visup.agent.storage.text_file import read_text_file
from visup.percepts.video.image_folder import IMAGE_SUFFIXES, VIDEO_SUFFIXES
from visup.percepts.video.ros_bag import is_bag
from visup.runs.settings import parse_actors

MANIFEST_SUFFIX = ".csv"
LARGEST_MANIFEST_BYTES = 128 * 2**20
SEQUENCE_FOLDERS = ("img1", "frames")
"""In a folder with one of these, images are a sequence in the layout of MOT or DAVIS."""
_OWN = ("source", "task", "actor", "taken")


@dataclass(frozen=True, slots=True)
class Clip:
    """One source with what is known of it.

    Attributes:
        source: A video file, or a folder of images.
        tasks: What it is watched for; those of the command where empty.
        actors: Actor -> models; those of the command where empty.
        taken: When it was made, seconds since the epoch; None for the time of its file.
        labels: Whatever else the manifest says of it.
    """

    source: Path
    tasks: tuple[str, ...] = ()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    taken: float | None = None
    labels: Mapping[str, str] = field(default_factory=dict)


def clips_of(sources: Iterable[str]) -> list[Clip]:
    """The clips that some words name, in their order, each once.

    Args:
        sources: Files; folders of images; folders in which clips are looked for, also further down; patterns
            with `*`, `?`, `[...]`, and `**` for any depth; manifests (`.csv`).

    Raises:
        SourceError: A word names no clip, or a manifest is not as it should be.
    """
    found: dict[Path, Clip] = {}
    for word in sources:
        for clip in _named(word):
            found.setdefault(clip.source, clip)
    return list(found.values())


def _named(word: str) -> list[Clip]:
    path = Path(word).expanduser()
    if path.suffix.lower() == MANIFEST_SUFFIX and path.is_file():
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
            expected="a video file, a folder of images, a folder with clips, a pattern or a manifest (.csv)",
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
    try:
        text = read_text_file(path, LARGEST_MANIFEST_BYTES)
        reader = csv.DictReader(StringIO(text), strict=True)
        if "source" not in (reader.fieldnames or ()):
            raise SourceError(
                "the manifest has no column `source`",
                where=str(path),
                expected="a head such as: source,task,actor,taken",
            )
        for row in reader:
            yield _clip(row, path, reader.line_num)
    except UnicodeDecodeError:
        raise SourceError("this is not text", where=str(path), expected="CSV in UTF-8") from None
    except (OSError, csv.Error) as fault:
        said = getattr(fault, "strerror", None) or fault
        raise SourceError(f"the manifest cannot be read ({said})", where=str(path)) from fault


def _clip(row: Mapping[str | None, str | None], manifest: Path, line: int) -> Clip:
    where = f"{manifest}:{line}"
    told = {str(k): (v or "").strip() for k, v in row.items() if k is not None}
    source = manifest.absolute().parent / Path(told["source"]).expanduser()
    if None in row or not told["source"] or not source.exists():
        what = "the line has more fields than the head" if None in row else "there is no such clip"
        raise SourceError(what, where=where, expected="a path from the folder of the manifest")
    tasks = tuple(_task(t, manifest) for t in _parts(told.get("task", "")))
    labels = {k: v for k, v in told.items() if k not in _OWN and v}
    actors = parse_actors(_parts(told.get("actor", "")))
    return Clip(source, tasks, actors, _taken(told.get("taken", ""), where), labels)


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
