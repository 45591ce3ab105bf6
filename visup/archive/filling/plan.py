"""Plans which runs of some clips are missing in a lake."""

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
    """A clip to process.

    Attributes:
        settings: Its settings.
        provenance: Key and origin of its run.
        bytes: Size of the source.
        spans: Its chunks; none if it is not cut.
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
    """A clip without a run.

    Attributes:
        source: The clip.
        reason: The reason.
        put_aside: Whether it is no longer tried because it crashed its worker twice.
    """

    source: str
    reason: str
    put_aside: bool = False


@dataclass(frozen=True, slots=True)
class Plan:
    """What to do.

    Attributes:
        jobs: The missing runs.
        present: Number of clips with a run in the lake.
        same: Number of clips with the content and settings of an earlier one.
        failed: Clips that cannot be processed or are put aside.
    """

    jobs: tuple[Job, ...] = ()
    present: int = 0
    same: int = 0
    failed: tuple[FailedClip, ...] = ()

    @property
    def bytes(self) -> int:
        """Size of all sources to process."""
        return sum(job.bytes for job in self.jobs)


def make_plan(
    lake: Lake | None,
    clips: Iterable[Clip],
    settings: WatchSettings,
    cutting: Cutting | None = None,
) -> Plan:
    """Find the missing runs.

    Args:
        lake: The lake; None if it does not exist yet.
        clips: The clips.
        settings: Settings of all clips, which a clip may override.
        cutting: How long clips are cut; None for not at all.

    Raises:
        VisupError: A file that the settings name cannot be read.
    """
    committed = frozenset(lake.runs() if lake else ())
    hashes: dict[str, str] = {}
    jobs: dict[str, Job] = {}
    present, same, failed = 0, 0, list[FailedClip]()
    for clip in clips:
        clip_config = clip_settings(settings, clip)
        about = repr(replace(clip_config, source=""))
        if about not in hashes:
            hashes[about] = settings_hash(clip_config)
        try:
            job = _job(clip, clip_config, hashes[about], cutting)
        except VisupError as fault:
            reason = str(fault).removeprefix(f"{clip.source}: ")
            failed.append(FailedClip(str(clip.source), reason))
            continue
        if job.run in jobs:
            same += 1
        elif job.run in committed:
            present += 1
        elif lake is not None and Attempts(lake.path, job.run).exhausted:
            failed.append(put_aside(job))
        else:
            jobs[job.run] = job
    return Plan(tuple(jobs.values()), present, same, tuple(failed))


def put_aside(job: Job) -> FailedClip:
    """The failure of a clip that crashed its workers."""
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
    """Check the settings before thousands of clips fail by them.

    Yields:
        Warnings, a sentence each.

    Raises:
        VisupError: A task, the models or a behaviour are not valid.
    """
    for settings in {repr(replace(j.settings, source="")): j.settings for j in jobs}.values():
        agent = build_agent(settings)
        try:
            yield from check_cast(settings, agent)
        finally:
            agent.close()


def _job(clip: Clip, settings: WatchSettings, by: str, cutting: Cutting | None) -> Job:
    content, modified, size = _facts(clip.source)
    taken = modified if clip.taken is None else clip.taken
    spans = cutting.spans(settings) if cutting and isinstance(clip.source, Path) else ()
    if cutting and spans:  # results may differ slightly
        by = hashlib.sha256(f"{by}\n{cutting}".encode()).hexdigest()
    key = run_key(content, by)
    return Job(settings, Provenance(key, content, by, taken, clip.labels), size, spans)


def _facts(source: Path | StoredFile) -> tuple[str, float | None, int]:
    """Content hash of a clip, time of recording, and size in bytes."""
    if isinstance(source, StoredFile):
        return source.content_hash, source.modified, source.bytes
    content = content_hash(source)
    files = source.rglob("*") if source.is_dir() else (source,)
    size = sum(f.stat().st_size for f in files if f.is_file())
    return content, source.stat().st_mtime, size
