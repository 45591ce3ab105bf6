"""`visup eval missions`: supervise missions whose truth is known, and score what was said.

The supervisor is given `mission.json` and the video, as `visup watch` would give them; `truth.json` and the
masks are read afterwards, by the scoring alone.
"""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from visup.agent import Frame, Mind, Pose, Region, Severity, Status, TaskBelief, Verdict
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.evaluation.missions.files import mission_folders, read_json
from visup.evaluation.missions.pose_errors import Poses, spin_error, view_error
from visup.evaluation.missions.scores import (
    UNSCORED_START_S,
    MissionTruth,
    ReportedEvent,
    StageSample,
    failing_latency,
    matched_events,
    parse_truth,
    precision_recall_f1,
    scored_alerts,
    stage_share,
)
from visup.runs.wiring import WatchSettings, build_agent, final_verdict, open_video

SMALLEST_SCORED_PX = 500
COVERING_IOU = 0.5


@dataclass(frozen=True, slots=True)
class ObservedObject:
    """An object as it was believed at one frame."""

    id: int
    name: str
    region: Region
    pose: Pose | None


@dataclass(slots=True)
class MissionRecorder:
    """What the supervisor said of one mission, frame by frame."""

    seen: dict[int, tuple[ObservedObject, ...]] = field(default_factory=dict)
    events: list[tuple[str, tuple[int, ...], float]] = field(default_factory=list)
    alerts: list[tuple[str, tuple[int, ...], float, bool]] = field(default_factory=list)
    stages: list[StageSample] = field(default_factory=list)
    last: Mind | None = None
    seconds: float = 0.0

    def __call__(self, step: Step, frame: Frame) -> None:
        """Take down one step; the agent calls it."""
        self.seen[step.frame_index] = tuple(
            ObservedObject(b.id, b.name, b.region, b.pose)
            for b in step.mind.objects.values()
            if b.last_seen == step.time
        )
        self.events += [(e.kind, e.objects, e.time) for e in step.events]
        self.alerts += [
            (a.kind, a.objects, a.opened, a.severity >= Severity.WARNING)
            for a in step.alerts
            if a.closed is None
        ]
        self.stages.append(_sample(step.mind))
        self.last = step.mind


def _sample(mind: Mind) -> StageSample:
    """The reported stage and its outcome so far.

    A stage that is done while no other has begun counts as progressing: its outcome so far is good,
    and in the truth a mission stays within its last stage until it ends.
    """
    task = mind.tasks[0] if mind.tasks else None
    done = [s.stage for s in task.stages if s.status is Status.DONE] if task else []
    stage = (task.current or (done[-1] if done else None)) if task else None
    if task is None or stage is None:
        return StageSample(mind.time, None, None)
    status = next(s.status for s in task.stages if s.stage == stage)
    return StageSample(mind.time, stage, _outcome(task, status))


def _outcome(task: TaskBelief, status: Status) -> str | None:
    if task.verdict is Verdict.INTERRUPTED:
        return "unsafe"
    if status in (Status.FAILING, Status.FAILED):
        return "failing"
    if status in (Status.PENDING, Status.UNKNOWN):
        return None
    return "progressing"


def evaluate_missions(
    folder: Path,
    *,
    models: Path | None = None,
    limit: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Figures over all missions below a folder.

    Args:
        folder: A mission, or a folder of missions.
        models: Model database; by default one is built from `../models/*.ply` beside `folder` and, for
            each model that an actor stands for, from silhouettes in `../shapes/<model>`.
        limit: Frames of each mission, for a quick look; all by default.
        progress: Told a line as each mission is done.

    Returns:
        {"total": {...}, "items": {mission: {...}}} with the keys of the data's README.

    Raises:
        SettingsError: There is no mission, or no database and nothing to build it from.
    """
    missions = mission_folders(folder)
    with tempfile.TemporaryDirectory() as scratch:
        database = models or _database(folder, missions, Path(scratch), progress)
        items: dict[str, dict[str, Any]] = {}
        for mission in missions:
            items[mission.name] = _evaluate(mission, database, limit)
            if progress:
                progress(f"{mission.name}: {items[mission.name]['verdict']}")
    return {"total": mission_total(list(items.values())), "items": items}


def _database(
    folder: Path, missions: Sequence[Path], scratch: Path, progress: Callable[[str], None] | None
) -> Path:
    """A model database from the meshes and silhouettes that stand beside the missions."""
    from visup.percepts.shape.building.build import build_database, read_silhouettes

    beside = missions[0].resolve().parent.parent
    meshes = sorted((beside / "models").glob("*.ply"))
    if not meshes:
        raise SettingsError(
            "there is no model database, and no ../models/*.ply to build one from",
            where=str(folder),
            hint="give one with --models DB",
        )
    told = [read_json(mission / "mission.json") for mission in missions]
    wanted = {m for t in told for m in t["actors"].values()}
    if progress:
        progress(f"building a database from {len(meshes)} meshes")
    path = scratch / "models.db"
    silhouettes = {
        name: read_silhouettes(beside / "shapes" / name)
        for name in sorted(wanted)
        if (beside / "shapes" / name).is_dir()
    }
    build_database(path, meshes, silhouettes)
    return path


def _evaluate(mission: Path, database: Path, limit: int | None) -> dict[str, Any]:
    record = _supervise(mission, database, limit)
    truth = read_json(mission / "truth.json")
    truths = parse_truth(truth, float(truth["fps"]))
    overlaps = _overlaps(mission, truth["labels"], record)
    return _scores(truth, truths, record, overlaps)


def _supervise(mission: Path, database: Path, limit: int | None) -> MissionRecorder:
    told = read_json(mission / "mission.json")
    settings = WatchSettings(
        source=str(mission / "video.mp4"),
        tasks=(str(told["task"]),),
        models=database,
        actors={a: (m,) for a, m in told["actors"].items()},
        fov_vertical_deg=told.get("fov_vertical_deg"),
    )
    record = MissionRecorder()
    agent = build_agent(settings, observers=(record,))
    begin = time.perf_counter()
    with open_video(settings) as source:
        agent.run(source, until=lambda s: limit is not None and s.frame_index + 1 >= limit)
    record.seconds = time.perf_counter() - begin
    return record


ObjectOverlaps = Mapping[int, Mapping[str, tuple[int, dict[int, float]]]]
"""Frame -> true object -> (visible pixels, believed object's id -> IoU with it)."""


def _overlaps(mission: Path, labels: Mapping[str, int], record: MissionRecorder) -> ObjectOverlaps:
    return {
        index: _overlap(mission / "masks" / f"{index:05d}.png", labels, seen)
        for index, seen in record.seen.items()
    }


def _overlap(
    path: Path, labels: Mapping[str, int], seen: Sequence[ObservedObject]
) -> dict[str, tuple[int, dict[int, float]]]:
    mask = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if mask is None:
        raise SettingsError("a mask is missing or cannot be read", where=str(path))
    return {name: _ious(mask == label, seen) for name, label in labels.items()}


def _ious(true: np.ndarray, seen: Sequence[ObservedObject]) -> tuple[int, dict[int, float]]:
    visible = int(true.sum())
    ious = {}
    for it in seen:
        x, y, w, h = it.region.bbox
        both = int((true[y : y + h, x : x + w] & it.region.mask).sum())
        if both:
            ious[it.id] = both / (visible + int(it.region.mask.sum()) - both)
    return visible, ious


def _true_names(overlaps: ObjectOverlaps) -> dict[int, str]:
    """Believed object's id -> the true object that it overlaps most over the whole mission."""
    weight: Counter[tuple[int, str]] = Counter()
    for objects in overlaps.values():
        for name, (_, ious) in objects.items():
            for number, iou in ious.items():
                weight[number, name] += iou  # type: ignore[assignment]  # a counter of shares
    best: dict[int, tuple[float, str]] = {}
    for (number, name), total in sorted(weight.items()):
        if total > best.get(number, (0.0, ""))[0]:
            best[number] = (total, name)
    return {number: name for number, (_, name) in best.items()}


def report_scores(
    truths: MissionTruth, record: MissionRecorder, names: Mapping[int, str]
) -> dict[str, Any]:
    """Figures of all that was said: events, stages, alerts, verdict.

    Args:
        truths: What truly happened.
        record: What was said.
        names: Believed object's id -> the true object that it stands for.

    Returns:
        By the keys of the data's README; counts of events as `event_counts`.
    """

    def true_objects(ids: Sequence[int]) -> frozenset[str]:
        return frozenset(names.get(i, "?") for i in ids)

    events = [ReportedEvent(kind, true_objects(ids), t) for kind, ids, t in record.events]
    alerts = [
        ReportedEvent(kind, true_objects(ids), t, grave) for kind, ids, t, grave in record.alerts
    ]
    right, excess, missed = matched_events(events, truths.events)
    precision, recall, f1 = precision_recall_f1(right, excess, missed)
    found, false = scored_alerts(alerts, truths.alerts)
    hours = max(record.last.time, 1.0) / 3600 if record.last else 1.0
    verdict = final_verdict(record.last).value if record.last else Verdict.UNKNOWN.value
    return {
        "event_precision": precision,
        "event_recall": recall,
        "event_f1": f1,
        "event_counts": [right, excess, missed],
        "stage": stage_share(record.stages, truths),
        "failing_latency_s": failing_latency(record.stages, truths),
        "alerts_found": found,
        "alerts_expected": len(truths.alerts),
        "false_alerts": false,
        "false_alerts_per_hour": false / hours,
        "hours": hours,
        "verdict": verdict,
        "verdicts_right": int(verdict == truths.verdict),
        "verdicts": 1,
    }


def _scores(
    truth: Mapping[str, Any],
    truths: MissionTruth,
    record: MissionRecorder,
    overlaps: ObjectOverlaps,
) -> dict[str, Any]:
    identified, scored = _identity(truths, record, overlaps)
    poses = _poses(truths, record, overlaps)
    scores: dict[str, Any] = {
        "identity": identified / scored if scored else None,
        "identity_counts": [identified, scored],
        **report_scores(truths, record, _true_names(overlaps)),
        "view_deg": view_error(truth, poses),
        "spin_error": spin_error(truth, poses),
        "fps": len(record.seen) / record.seconds if record.seconds else None,
    }
    return {k: v for k, v in scores.items() if v is not None}


def _identity(
    truths: MissionTruth, record: MissionRecorder, overlaps: ObjectOverlaps
) -> tuple[int, int]:
    """Object-frames with the right first candidate, and all that are scored."""
    entered = {
        name: min(
            (e.time for e in truths.events if e.kind == "entry" and name in e.objects), default=0.0
        )
        for name in truths.names
    }
    times = {index: sample.time for index, sample in zip(record.seen, record.stages, strict=True)}
    right = scored = 0
    for index, objects in overlaps.items():
        believed = {it.id: it.name for it in record.seen[index]}
        for name, (visible, ious) in objects.items():
            late = name in entered and times[index] >= entered[name] + UNSCORED_START_S
            if visible < SMALLEST_SCORED_PX or not late:
                continue
            scored += 1
            number = max(ious, key=lambda i: ious[i], default=None)
            if number is not None and ious[number] >= COVERING_IOU:
                right += believed[number] == truths.names[name]
    return right, scored


def _poses(truths: MissionTruth, record: MissionRecorder, overlaps: ObjectOverlaps) -> Poses:
    """Poses told of true objects that are seen and rightly named, by frame and object."""
    found: dict[tuple[int, str], Pose] = {}
    for index, objects in overlaps.items():
        for name, (visible, ious) in objects.items():
            number = max(ious, key=lambda i: ious[i], default=None)
            if visible < SMALLEST_SCORED_PX or number is None:
                continue
            it = next(s for s in record.seen[index] if s.id == number)
            if it.pose is not None and it.name == it.pose.name == truths.names.get(name):
                found[index, name] = it.pose
    return found


def mission_total(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures over all missions: counts are added up, so that each frame and event weighs alike."""
    right, excess, missed = (sum(i["event_counts"][k] for i in items) for k in range(3))
    precision, recall, f1 = precision_recall_f1(right, excess, missed)
    identified, scored = (sum(i["identity_counts"][k] for i in items) for k in range(2))
    hours = sum(i["hours"] for i in items)
    total: dict[str, Any] = {
        "identity": identified / scored if scored else None,
        "event_precision": precision,
        "event_recall": recall,
        "event_f1": f1,
        "stage": _mean([i["stage"] for i in items if "stage" in i]),
        "failing_latency_s": max(
            (i["failing_latency_s"] for i in items if "failing_latency_s" in i), default=None
        ),
        "view_deg": _mean([i["view_deg"] for i in items if "view_deg" in i]),
        "spin_error": _mean([i["spin_error"] for i in items if "spin_error" in i]),
        "fps": _mean([i["fps"] for i in items if "fps" in i]),
        "false_alerts_per_hour": sum(i["false_alerts"] for i in items) / hours if hours else None,
    }
    for key in ("alerts_found", "alerts_expected", "false_alerts", "verdicts_right", "verdicts"):
        total[key] = sum(i[key] for i in items)
    return {k: v for k, v in total.items() if v is not None}


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None
