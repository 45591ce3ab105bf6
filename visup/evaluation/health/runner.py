"""`visup eval health`: faults put into sound video, and what the health behaviour says of it.

Every clip is also run unharmed: what is reported of it is a false report.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import Frame, HealthStatus, Observation
from visup.agent.model.errors import SettingsError, VisupError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.health.camera_faults import EXPECTED, inject
from visup.percepts.health import HealthBehaviour
from visup.percepts.video import open_source
from visup.percepts.video.image_folder import VIDEO_SUFFIXES, images_in

FAULTS = 100
WITHIN_S = 1.0
SOUND_S = (0.6, 1.4)
"""A fault begins this long after the start of its clip: drawn from this range."""
FAULTY_S = 1.2


@dataclass(frozen=True, slots=True)
class CameraFaultTrial:
    """One fault in one clip.

    Attributes:
        source: The video.
        kind: A key of `EXPECTED`.
        skip: Share of the video's spare frames that come before the clip, 0 to 1.
        sound_s: Seconds before the fault.
        seed: Of what is drawn for the fault.
    """

    source: Path
    kind: str
    skip: float
    sound_s: float
    seed: int


@dataclass(frozen=True, slots=True)
class TrialResult:
    """What was reported in one trial.

    Attributes:
        kind: The fault.
        found: A fault was reported within a second of its start.
        named: Its right name was among what was reported.
        latency_s: From the start of the fault to the first report, seconds, or None.
        early: A fault was reported before there was one.
    """

    kind: str
    found: bool
    named: bool
    latency_s: float | None
    early: bool


def evaluate_health(
    folder: Path,
    *,
    faults: int = FAULTS,
    seed: int = 0,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Put faults into video below a folder, and run it unharmed too.

    Args:
        folder: Video files and folders of images stand anywhere below it.
        faults: How many faults; they go round the kinds and the videos.
        seed: Of the campaign.
        limit: Most frames of each video when it is run unharmed, or None for all.
        progress: Shows what is being done.

    Returns:
        `items` by kind of fault, and `total`, with the keys `clips`, `found` (share reported within
        1 s), `named` (share of them with the right status), `latency_s` (median), `early` (reports
        before the fault); `total` also has `false_reports`, `hours`, `false_reports_per_hour`, and
        `ms` (median time of a frame). `missed` lists the trials that were not found or not named.

    Raises:
        SettingsError: There is no video below the folder.
    """
    sources = find_sources(folder)
    told: list[TrialResult] = []
    missed: list[dict[str, Any]] = []
    for number, trial in enumerate(plan(sources, faults, seed)):
        progress(f"fault {number + 1} of {faults}")
        told.append(result := run_trial(trial))
        if not (result.found and result.named):
            name = str(trial.source.relative_to(folder)) if trial.source != folder else folder.name
            missed.append({"source": name, "kind": trial.kind, "number": number, **_plain(result)})
    items = {k: _scores([t for t in told if t.kind == k]) for k in EXPECTED}
    total = _scores(told)
    total |= _unharmed(sources, limit, progress)
    return {"total": total, "items": {k: v for k, v in items.items() if v}, "missed": missed}


def find_sources(folder: Path) -> list[Path]:
    """Video files and folders of images below a folder, by name; masks are left out.

    Raises:
        SettingsError: There are none.
    """
    places = [folder, *sorted(folder.rglob("*"))]
    files = [p for p in places if p.suffix.lower() in VIDEO_SUFFIXES and p.is_file()]
    # Truth stands beside what it is the truth of.
    folders = [p for p in places if p.is_dir() and p.name not in ("masks", "gt")]
    found = files + [p for p in folders if len(images_in(p)) > 1]
    found = [p for p in found if _opens(p)]
    if not found:
        raise SettingsError(
            "no video was found", where=str(folder), expected="video files or folders of images"
        )
    return sorted(found)


def _opens(path: Path) -> bool:
    try:
        with open_source(str(path)):
            return True
    except VisupError:
        return False


def plan(sources: Sequence[Path], faults: int, seed: int) -> Iterator[CameraFaultTrial]:
    """The trials of a campaign: kinds in turn, videos in a shuffled order, the rest drawn."""
    rng = np.random.default_rng(seed)
    kinds = list(EXPECTED)
    order: list[int] = []
    for number in range(faults):
        order = order or rng.permutation(len(sources)).tolist()
        yield CameraFaultTrial(
            source=sources[order.pop()],
            kind=kinds[number % len(kinds)],
            skip=float(rng.random()),
            sound_s=float(rng.uniform(*SOUND_S)),
            seed=int(rng.integers(2**31)),
        )


def run_trial(trial: CameraFaultTrial) -> TrialResult:
    """Inject one fault and tell how it was reported."""
    frames = _clip(trial)
    # A short video leaves less time before the fault: what counts is the second after it.
    longest = frames[-1].time - frames[0].time - FAULTY_S
    begin = frames[0].time + max(SOUND_S[0], min(trial.sound_s, longest))
    start = next((n for n, f in enumerate(frames) if f.time >= begin), len(frames) // 2)
    since = frames[start].time
    seen = [(f.time, s) for f, s in statuses(inject(frames, start, trial.kind, trial.seed))]
    bad = [(t, s) for t, s in seen if s is not HealthStatus.OK]
    within = [(t, s) for t, s in bad if since <= t <= since + WITHIN_S + 1e-6]
    return TrialResult(
        kind=trial.kind,
        found=bool(within),
        named=any(s is EXPECTED[trial.kind] for _, s in within),
        latency_s=within[0][0] - since if within else None,
        early=any(t < since for t, _ in bad),
    )


def _clip(trial: CameraFaultTrial) -> list[Frame]:
    """The frames of a trial; all of a video that is not longer."""
    with open_source(str(trial.source)) as source:
        length = round((trial.sound_s + FAULTY_S) * source.fps) + 1
        spare = max(0, (source.frame_count or length) - length)
        return list(islice(source, round(trial.skip * spare), None))[:length]


def statuses(frames: Iterator[Frame] | Sequence[Frame]) -> Iterator[tuple[Frame, HealthStatus]]:
    """What the health behaviour reports of each frame."""
    behaviour = HealthBehaviour()
    for frame in frames:
        nothing = Observation(frame.index, frame.time, frame.size)
        for percept in behaviour.perceive(frame, nothing, ()):
            yield frame, percept.value.status


def _unharmed(sources: Sequence[Path], limit: int | None, progress: Progress) -> dict[str, Any]:
    """False reports (each run of frames that are not well is one) and the time of a frame."""
    reports, seconds = 0, 0.0
    ms: list[float] = []
    for path in sources:
        progress(f"{path.name}, unharmed")
        before = HealthStatus.OK
        with open_source(str(path)) as source:
            last = 0.0
            behaviour = HealthBehaviour()
            for frame in islice(source, limit):
                nothing = Observation(frame.index, frame.time, frame.size)
                start = time.perf_counter()
                (percept,) = behaviour.perceive(frame, nothing, ())
                ms.append(1e3 * (time.perf_counter() - start))
                status = percept.value.status
                reports += before is HealthStatus.OK and status is not HealthStatus.OK
                before, last = status, frame.time
            seconds += last
    hours = seconds / 3600
    return {
        "false_reports": reports,
        "hours": hours,
        "false_reports_per_hour": reports / hours if hours else 0.0,
        "ms": statistics.median(ms) if ms else 0.0,
    }


def _scores(told: Sequence[TrialResult]) -> dict[str, Any]:
    if not told:
        return {}
    latencies = [t.latency_s for t in told if t.latency_s is not None]
    out: dict[str, Any] = {
        "clips": len(told),
        "found": sum(t.found for t in told) / len(told),
        "named": sum(t.named for t in told) / len(told),
        "early": sum(t.early for t in told),
    }
    if latencies:
        out["latency_s"] = statistics.median(latencies)
    return out


def _plain(told: TrialResult) -> Mapping[str, Any]:
    return {"found": told.found, "named": told.named, "early": told.early}
