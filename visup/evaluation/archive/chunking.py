"""The effect of processing a video in chunks: its events compared with those of an uncut run.

As a control the same video is processed uncut without its first frame: outlines then differ by some pixels,
so that values near thresholds fall differently by chance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.agent.model.step import Step
from visup.archive.chunks.region_matching import RegionMatcher
from visup.archive.chunks.spans import Cutting
from visup.archive.filling.clips import Clip
from visup.archive.filling.filling import fill
from visup.archive.filling.plan import make_plan
from visup.archive.filling.pool import Pool
from visup.archive.filling.watching import ClipOutcome, Watch, watch_into
from visup.archive.lake import Lake
from visup.evaluation.figures import Progress
from visup.evaluation.missions.runner import mission_settings
from visup.evaluation.missions.scores import EVENT_TOLERANCE_S, SCORED_EVENTS, precision_recall_f1
from visup.runs.replay import Line, Transcript, replay
from visup.runs.wiring import open_video

CHUNKS = 3
EventCounts = tuple[int, int, int]
"""Equal, excess and missed events."""
Beliefs = Mapping[int, Sequence[Region]]
"""Frame -> visible objects, as regions with the ids of the objects."""


def compare_chunks(
    place: Path, missions: Sequence[Path], database: Path, progress: Progress
) -> dict[str, Any]:
    """Process missions uncut and in three chunks.

    Args:
        place: A folder for the lakes.
        missions: Folders with `mission.json` and `video.mp4`.
        database: The model database.
        progress: Shows what is being done.

    Returns:
        `missions`; `events` of the uncut runs, `missed` and `excess` of those in chunks, `event_f1`,
        `scored_f1` of the scored kinds, `shifted_f1` of the uncut runs without their first frame; `verdicts`
        that differ; `longer`, the relative overhead in frames; `worst` mission by F1.
    """
    found = [_compared(place, mission, database, progress) for mission in missions]
    right, excess, missed = _sums(one.counts for one in found)
    return {
        "missions": len(missions),
        "events": right + missed,
        "excess": excess,
        "missed": missed,
        "event_f1": precision_recall_f1(right, excess, missed)[2],
        "scored_f1": precision_recall_f1(*_sums(one.scored for one in found))[2],
        "shifted_f1": precision_recall_f1(*_sums(one.shifted for one in found))[2],
        "verdicts": sum(one.verdicts[0] != one.verdicts[1] for one in found),
        "longer": sum(one.looked for one in found) / sum(one.frames for one in found) - 1.0,
        "worst": min(found, key=lambda one: precision_recall_f1(*one.counts)[2]).mission,
    }


@dataclass(frozen=True, slots=True)
class _Compared:
    """A mission uncut and in chunks.

    Attributes:
        mission: Its name.
        counts: Equal, excess and missed events.
        scored: The same for scored kinds only.
        shifted: The same for the uncut run without its first frame.
        verdicts: Both verdicts.
        frames: Frames of the video.
        looked: Total frames of all chunks.
    """

    mission: str
    counts: EventCounts
    scored: EventCounts
    shifted: EventCounts
    verdicts: tuple[str | None, str | None]
    frames: int
    looked: int


def _compared(place: Path, mission: Path, database: Path, progress: Progress) -> _Compared:
    settings = mission_settings(mission, database)
    with open_video(settings) as source:
        frames, seconds = source.frame_count or 0, (source.frame_count or 0) / source.fps
    ways: Mapping[str, tuple[Cutting | None, Watch]] = {
        "whole": (None, watch_into),
        "cut": (Cutting(seconds / CHUNKS), watch_into),
        "shifted": (None, partial(watch_into, span=(1, None))),
    }
    lakes = {}
    for name, (cutting, watch) in ways.items():
        progress(f"{mission.name}, {name}")
        lake = lakes[name] = Lake.create(place / f"{mission.name}-{name}")
        plan = make_plan(lake, [Clip(mission / "video.mp4", taken=0.0)], settings, cutting)
        fill(lake, plan, Pool(), _silent, watch)
    counts, scored = _counted(lakes["whole"], lakes["cut"])
    shifted, _ = _counted(lakes["whole"], lakes["shifted"])
    progress(f"{mission.name}: {counts[0]} events alike, {counts[1]} in excess, {counts[2]} missed")
    facts, (row,) = _facts(lakes["cut"]), lakes["whole"].rows("runs")
    looked = sum(last - first + 1 for first, last in facts["chunks"])
    verdicts = row["verdict"], facts["verdict"]
    return _Compared(mission.name, counts, scored, shifted, verdicts, frames, looked)


def _counted(whole: Lake, other: Lake) -> tuple[EventCounts, EventCounts]:
    """Compare the events of two runs of a video: all, and those of scored kinds."""
    (one, seen), (again, seen_again) = _told(whole), _told(other)
    same = same_objects(seen, seen_again)
    return (
        matching_events(one.events, again.events, same),
        matching_events(_scored(one.events), _scored(again.events), same),
    )


def _facts(lake: Lake) -> Mapping[str, Any]:
    (run,) = lake.runs()
    return lake.recorded(run)[0].facts()


def matching_events(
    whole: Iterable[Line], cut: Iterable[Line], same: Mapping[int, int]
) -> EventCounts:
    """Numbers of equal, excess and missed events of a run in chunks.

    Events are equal if kind, objects and named details agree within a second; each counts once.

    Args:
        whole: Events of the uncut run.
        cut: Events of the other run.
        same: Object of the other run -> object of the uncut run.
    """
    real, said = list(whole), list(cut)
    left = set(range(len(real)))
    for event in said:
        near = [
            (abs(real[n]["time"] - event["time"]), n)
            for n in left
            if _about(real[n], {}) == _about(event, same)
        ]
        if near and min(near)[0] <= EVENT_TOLERANCE_S:
            left.discard(min(near)[1])
    right = len(real) - len(left)
    return right, len(said) - right, len(left)


def _scored(events: Iterable[Line]) -> list[Line]:
    return [e for e in events if e["kind"] in SCORED_EVENTS]


def _sums(counts: Iterable[EventCounts]) -> EventCounts:
    right, excess, missed = map(sum, zip(*counts, strict=True))
    return right, excess, missed


def same_objects(whole: Beliefs, cut: Beliefs) -> dict[int, int]:
    """Object of the run in chunks -> object of the uncut one, by overlap."""
    matcher = RegionMatcher()
    for frame in whole.keys() & cut.keys():
        matcher.add(whole[frame], cut[frame])
    return matcher.same()


def _about(event: Line, same: Mapping[int, int]) -> tuple[Any, ...]:
    named = {k: v for k, v in event["data"].items() if isinstance(v, str)}
    objects = tuple(same.get(o, -o) for o in event["objects"]) if same else tuple(event["objects"])
    return event["kind"], objects, tuple(sorted(named.items()))


def _told(lake: Lake) -> tuple[Transcript, Beliefs]:
    """The transcript of the run of a lake, and the regions of its objects."""
    seen: dict[int, list[Region]] = {}

    def look(step: Step) -> None:
        seen[step.frame_index] = [
            replace(b.region, id=b.id)
            for b in step.mind.objects.values()
            if b.last_seen == step.time
        ]

    (run,) = lake.runs()
    return replay(*lake.recorded(run), on_step=look), seen


def _silent(outcome: ClipOutcome) -> None:
    """Ignore an outcome."""
