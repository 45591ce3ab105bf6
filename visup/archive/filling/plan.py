"""What is missing in a lake of the runs of some clips."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from visup.agent.model.errors import VisupError
from visup.archive.chunks.spans import ChunkSpan, Cutting
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.clips import Clip
from visup.archive.filling.stores import StoredFile
from visup.archive.identity import content_hash, run_key, settings_hash
from visup.archive.lake import Lake
from visup.archive.run_tables import Provenance
from visup.runs.inputs.preflight import check_cast
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent


@dataclass(frozen=True, slots=True)
class Job:
    """A clip that is to be watched.

    Attributes:
        settings: With which.
        provenance: What its run is called, and where it comes from.
        bytes: Of the source.
        spans: The chunks in which it is watched; none where it is not cut.
    """

    settings: WatchSettings
    provenance: Provenance
    bytes: int = 0
    spans: tuple[ChunkSpan, ...] = ()

    @property
    def run(self) -> str:
        """The key of its run."""
        return self.provenance.run


@dataclass(frozen=True, slots=True)
class FailedClip:
    """A clip of which there is no run.

    Attributes:
        source: The clip.
        reason: Why.
        put_aside: Whether it is not tried any more, since it has ended its worker twice.
    """

    source: str
    reason: str
    put_aside: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """What is to be done.

    Attributes:
        jobs: The runs that are missing.
        present: How many clips have their run in the lake.
        same: How many clips have the same content and settings as one before.
        failed: Clips that cannot be watched, or are put aside.
    """

    jobs: tuple[Job, ...] = ()
    present: int = 0
    same: int = 0
    failed: tuple[FailedClip, ...] = ()

    @property
    def bytes(self) -> int:
        """Of all sources that are to be watched."""
        return sum(job.bytes for job in self.jobs)


def make_plan(
    lake: Lake | None,
    clips: Iterable[Clip],
    settings: WatchSettings,
    cutting: Cutting | None = None,
) -> Plan:
    """Find out which runs are missing.

    Args:
        lake: Where to; None where there is none yet.
        clips: What is to be watched.
        settings: Those of all clips, but for what each says itself.
        cutting: How long clips are cut; None for not at all.

    Raises:
        VisupError: A file that the settings name cannot be read.
    """
    there = frozenset(lake.runs() if lake else ())
    hashes: dict[str, str] = {}
    jobs: dict[str, Job] = {}
    present, same, failed = 0, 0, list[FailedClip]()
    for clip in clips:
        own = clip_settings(settings, clip)
        about = repr(replace(own, source=""))
        if about not in hashes:
            hashes[about] = settings_hash(own)
        try:
            job = _job(clip, own, hashes[about], cutting)
        except VisupError as fault:
            reason = str(fault).removeprefix(f"{clip.source}: ")
            failed.append(FailedClip(str(clip.source), reason))
            continue
        if job.run in jobs:
            same += 1
        elif job.run in there:
            present += 1
        elif lake is not None and Attempts(lake.path, job.run).exhausted:
            failed.append(put_aside(job))
        else:
            jobs[job.run] = job
    return Plan(tuple(jobs.values()), present, same, tuple(failed))


def put_aside(job: Job) -> FailedClip:
    """What is said of a clip that ends its workers."""
    return FailedClip(
        job.settings.source,
        "it has ended its worker twice (killed, or out of memory), and is put aside; "
        "--retry tries it again",
        put_aside=True,
    )


def clip_settings(settings: WatchSettings, clip: Clip) -> WatchSettings:
    """The settings for one clip."""
    return replace(
        settings,
        source=str(clip.source),
        tasks=clip.tasks or settings.tasks,
        actors=clip.actors or settings.actors,
    )


def check_settings(jobs: Sequence[Job]) -> Iterator[str]:
    """Refuse settings with which no clip could be watched, before thousands are tried.

    Yields:
        What may keep the runs from coming to anything, a sentence each.

    Raises:
        VisupError: A task, the models or a behaviour are not as they should be.
    """
    for settings in {repr(replace(j.settings, source="")): j.settings for j in jobs}.values():
        agent = build_agent(settings)
        try:
            yield from check_cast(settings, agent)
        finally:
            agent.close()


def _job(clip: Clip, settings: WatchSettings, by: str, cutting: Cutting | None) -> Job:
    content, made, size = _facts(clip.source)
    taken = made if clip.taken is None else clip.taken
    spans = cutting.spans(settings) if cutting and isinstance(clip.source, Path) else ()
    if cutting and spans:  # what is seen may be another by a little
        by = hashlib.sha256(f"{by}\n{cutting}".encode()).hexdigest()
    key = run_key(content, by)
    return Job(settings, Provenance(key, content, by, taken, clip.labels), size, spans)


def _facts(source: Path | StoredFile) -> tuple[str, float | None, int]:
    """What tells the content of a clip apart, when it was made, and its size in bytes."""
    if isinstance(source, StoredFile):
        return source.content_hash, source.modified, source.bytes
    content = content_hash(source)
    files = source.rglob("*") if source.is_dir() else (source,)
    size = sum(f.stat().st_size for f in files if f.is_file())
    return content, source.stat().st_mtime, size
