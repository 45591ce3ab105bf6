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
"""True positives, false positives and false negatives: events in both runs, excess and missed ones."""
RegionsByFrame = Mapping[int, Sequence[Region]]
"""Frame -> visible objects, as regions with the ids of the objects."""


def compare_chunks(
    folder: Path, missions: Sequence[Path], database: Path, progress: Progress
) -> dict[str, Any]:
    """Process missions uncut and in three chunks.

    Args:
        folder: A folder for the lakes.
        missions: Folders with `mission.json` and `video.mp4`.
        database: The model database.
        progress: Shows what is being done.

    Returns:
        `missions`; `events` of the uncut runs, `missed` and `excess` of those in chunks, `event_f1`,
        `scored_f1` of the scored kinds, `shifted_f1` of the uncut runs without their first frame; `verdicts`
        that differ; `longer`, the relative overhead in frames; `worst` mission by F1.
    """
    comparisons = [_compare_mission(folder, mission, database, progress) for mission in missions]
    matched, excess, missed = _sums(c.counts for c in comparisons)
    return {
        "missions": len(missions),
        "events": matched + missed,
        "excess": excess,
        "missed": missed,
        "event_f1": precision_recall_f1(matched, excess, missed)[2],
        "scored_f1": precision_recall_f1(*_sums(c.scored for c in comparisons))[2],
        "shifted_f1": precision_recall_f1(*_sums(c.shifted for c in comparisons))[2],
        "verdicts": sum(c.verdicts[0] != c.verdicts[1] for c in comparisons),
        "longer": sum(c.processed for c in comparisons) / sum(c.frames for c in comparisons) - 1.0,
        "worst": min(comparisons, key=lambda c: precision_recall_f1(*c.counts)[2]).mission,
    }


@dataclass(frozen=True, slots=True)
class _ChunkComparison:
    """The comparison of a mission uncut and in chunks.

    Attributes:
        mission: Its name.
        counts: Counts of all events.
        scored: The same for scored kinds only.
        shifted: The same for the uncut run without its first frame.
        verdicts: Both verdicts.
        frames: Frames of the video.
        processed: Total frames of all chunks.
    """

    mission: str
    counts: EventCounts
    scored: EventCounts
    shifted: EventCounts
    verdicts: tuple[str | None, str | None]
    frames: int
    processed: int


def _compare_mission(
    folder: Path, mission: Path, database: Path, progress: Progress
) -> _ChunkComparison:
    settings = mission_settings(mission, database)
    with open_video(settings) as source:
        frames, seconds = source.frame_count or 0, (source.frame_count or 0) / source.fps
    variants: Mapping[str, tuple[Cutting | None, Watch]] = {
        "whole": (None, watch_into),
        "cut": (Cutting(seconds / CHUNKS), watch_into),
        "shifted": (None, partial(watch_into, span=(1, None))),
    }
    lakes = {}
    for name, (cutting, watch) in variants.items():
        progress(f"{mission.name}, {name}")
        lake = lakes[name] = Lake.create(folder / f"{mission.name}-{name}")
        plan = make_plan(lake, [Clip(mission / "video.mp4", taken=0.0)], settings, cutting)
        fill(lake, plan, Pool(), _ignore_outcome, watch)
    counts, scored = _compare_runs(lakes["whole"], lakes["cut"])
    shifted, _ = _compare_runs(lakes["whole"], lakes["shifted"])
    progress(f"{mission.name}: {counts[0]} events alike, {counts[1]} in excess, {counts[2]} missed")
    facts, (uncut_facts,) = _facts(lakes["cut"]), lakes["whole"].rows("runs")
    processed = sum(last - first + 1 for first, last in facts["chunks"])
    verdicts = uncut_facts["verdict"], facts["verdict"]
    return _ChunkComparison(mission.name, counts, scored, shifted, verdicts, frames, processed)


def _compare_runs(whole: Lake, other: Lake) -> tuple[EventCounts, EventCounts]:
    """Compare the events of two runs of a video: all, and those of scored kinds."""
    (expected, whole_regions), (observed, other_regions) = (
        _replay_with_regions(whole),
        _replay_with_regions(other),
    )
    object_map = matched_objects(whole_regions, other_regions)
    return (
        matching_events(expected.events, observed.events, object_map),
        matching_events(
            _scored_events(expected.events),
            _scored_events(observed.events),
            object_map,
        ),
    )


def _facts(lake: Lake) -> Mapping[str, Any]:
    (run,) = lake.runs()
    return lake.recorded(run)[0].facts()


def matching_events(
    whole: Iterable[Line], cut: Iterable[Line], object_map: Mapping[int, int]
) -> EventCounts:
    """Match the events of a run in chunks to those of the uncut run.

    Two events match if kind, objects and named details agree and they are within a second of each other;
    each is matched once, to the nearest in time.

    Args:
        whole: Events of the uncut run.
        cut: Events of the other run.
        object_map: Object of the other run -> object of the uncut run.

    Returns:
        Numbers of matched, excess and missed events.
    """
    expected, observed = list(whole), list(cut)
    unmatched = set(range(len(expected)))
    for event in observed:
        candidates = [
            (abs(expected[n]["time"] - event["time"]), n)
            for n in unmatched
            if _event_key(expected[n], {}) == _event_key(event, object_map)
        ]
        if candidates and min(candidates)[0] <= EVENT_TOLERANCE_S:
            unmatched.discard(min(candidates)[1])
    matched = len(expected) - len(unmatched)
    return matched, len(observed) - matched, len(unmatched)


def _scored_events(events: Iterable[Line]) -> list[Line]:
    return [event for event in events if event["kind"] in SCORED_EVENTS]


def _sums(counts: Iterable[EventCounts]) -> EventCounts:
    matched, excess, missed = map(sum, zip(*counts, strict=True))
    return matched, excess, missed


def matched_objects(whole: RegionsByFrame, cut: RegionsByFrame) -> dict[int, int]:
    """Object of the run in chunks -> object of the uncut one, by overlap."""
    matcher = RegionMatcher()
    for frame in whole.keys() & cut.keys():
        matcher.add(whole[frame], cut[frame])
    return matcher.same()


def _event_key(event: Line, object_map: Mapping[int, int]) -> tuple[Any, ...]:
    named = {key: value for key, value in event["data"].items() if isinstance(value, str)}
    objects = (
        tuple(object_map.get(o, -o) for o in event["objects"])
        if object_map
        else tuple(event["objects"])
    )
    return event["kind"], objects, tuple(sorted(named.items()))


def _replay_with_regions(lake: Lake) -> tuple[Transcript, RegionsByFrame]:
    """The transcript of the only run of a lake, and the regions of its objects by frame."""
    regions: dict[int, list[Region]] = {}

    def record_regions(step: Step) -> None:
        regions[step.frame_index] = [
            replace(belief.region, id=belief.id)
            for belief in step.mind.objects.values()
            if belief.last_seen == step.time
        ]

    (run,) = lake.runs()
    return replay(*lake.recorded(run), on_step=record_regions), regions


def _ignore_outcome(outcome: ClipOutcome) -> None:
    """Ignore an outcome."""
