"""`visup eval missions`: supervises missions with known truth and scores the reports.

The supervisor gets `mission.json` and the video, as in `visup watch`; `truth.json` and the masks are read
only afterwards for scoring.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from visup.agent import Verdict
from visup.agent.model.errors import SettingsError
from visup.evaluation.figures import Progress, mean_of, silent, sums_of
from visup.evaluation.missions.files import mission_folders, read_json
from visup.evaluation.missions.overlaps import (
    ObjectOverlaps,
    identity_counts,
    overlaps_of,
    reported_poses,
    true_names,
)
from visup.evaluation.missions.pose_errors import spin_error, view_error
from visup.evaluation.missions.recorder import MissionRecorder
from visup.evaluation.missions.scores import (
    MissionTruth,
    ReportedEvent,
    failing_latency,
    matched_events,
    parse_truth,
    precision_recall_f1,
    scored_alerts,
    stage_share,
)
from visup.runs.wiring import WatchSettings, build_agent, final_verdict, open_video


def evaluate_missions(
    folder: Path,
    *,
    models: Path | None = None,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Figures over all missions below a folder.

    Args:
        folder: A mission, or a folder of missions.
        models: Model database; by default one is built from `../models/*.ply` next to `folder` and, for
            each model of an actor, from silhouettes in `../shapes/<model>`.
        limit: Maximum frames of each mission; all by default.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {mission: {...}}} with the keys of the data's README.

    Raises:
        SettingsError: There is no mission, or no database and nothing to build it from.
    """
    missions = mission_folders(folder)
    with tempfile.TemporaryDirectory() as scratch:
        database = models or mission_database(folder, missions, Path(scratch), progress)
        items: dict[str, dict[str, Any]] = {}
        for mission in missions:
            items[mission.name] = _evaluate(mission, database, limit)
            progress(f"{mission.name}: {items[mission.name]['verdict']}")
    return {"total": mission_total(list(items.values())), "items": items}


def mission_database(
    folder: Path, missions: Sequence[Path], scratch: Path, progress: Progress
) -> Path:
    """A model database from the meshes and silhouettes next to the missions."""
    from visup.percepts.shape.building.database_builder import build_database, read_silhouettes

    data_folder = missions[0].resolve().parent.parent
    meshes = sorted((data_folder / "models").glob("*.ply"))
    if not meshes:
        raise SettingsError(
            "there is no model database, and no ../models/*.ply to build one from",
            where=str(folder),
            hint="give one with --models DB",
        )
    descriptions = [read_json(mission / "mission.json") for mission in missions]
    models = {model for description in descriptions for model in description["actors"].values()}
    progress(f"building a database from {len(meshes)} meshes")
    path = scratch / "models.db"
    silhouettes = {
        name: read_silhouettes(data_folder / "shapes" / name)
        for name in sorted(models)
        if (data_folder / "shapes" / name).is_dir()
    }
    build_database(path, meshes, silhouettes)
    return path


def _evaluate(mission: Path, database: Path, limit: int | None) -> dict[str, Any]:
    recorder = _supervise(mission, database, limit)
    document = read_json(mission / "truth.json")
    truth = parse_truth(document, float(document["fps"]))
    overlaps = overlaps_of(mission, document["labels"], recorder)
    return _scores(document, truth, recorder, overlaps)


def mission_settings(mission: Path, database: Path) -> WatchSettings:
    """The settings of a mission from its `mission.json`."""
    description = read_json(mission / "mission.json")
    return WatchSettings(
        source=str(mission / "video.mp4"),
        tasks=(str(description["task"]),),
        models=database,
        actors={a: (m,) for a, m in description["actors"].items()},
        fov_vertical_deg=description.get("fov_vertical_deg"),
    )


def _supervise(mission: Path, database: Path, limit: int | None) -> MissionRecorder:
    settings = mission_settings(mission, database)
    recorder = MissionRecorder()
    agent = build_agent(settings, observers=(recorder,))
    begin = time.perf_counter()
    with open_video(settings) as source:
        agent.run(source, until=lambda s: limit is not None and s.frame_index + 1 >= limit)
    recorder.seconds = time.perf_counter() - begin
    return recorder


def report_scores(
    truth: MissionTruth, recorder: MissionRecorder, names: Mapping[int, str]
) -> dict[str, Any]:
    """Figures of events, stages, alerts and verdict.

    Args:
        truth: The truth.
        recorder: The reports.
        names: Id of a believed object -> true object.

    Returns:
        By the keys of the data's README; counts of events as `event_counts`.
    """

    def true_objects(ids: Sequence[int]) -> frozenset[str]:
        return frozenset(names.get(i, "?") for i in ids)

    events = [ReportedEvent(kind, true_objects(ids), t) for kind, ids, t in recorder.events]
    alerts = [
        ReportedEvent(kind, true_objects(ids), t, severe)
        for kind, ids, t, severe in recorder.alerts
    ]
    true_positives, false_positives, false_negatives = matched_events(events, truth.events)
    precision, recall, f1 = precision_recall_f1(true_positives, false_positives, false_negatives)
    found, false_alerts = scored_alerts(alerts, truth.alerts)
    hours = max(recorder.last.time, 1.0) / 3600 if recorder.last else 1.0
    verdict = final_verdict(recorder.last).value if recorder.last else Verdict.UNKNOWN.value
    return {
        "event_precision": precision,
        "event_recall": recall,
        "event_f1": f1,
        "event_counts": [true_positives, false_positives, false_negatives],
        "stage": stage_share(recorder.stages, truth),
        "failing_latency_s": failing_latency(recorder.stages, truth),
        "alerts_found": found,
        "alerts_expected": len(truth.alerts),
        "false_alerts": false_alerts,
        "false_alerts_per_hour": false_alerts / hours,
        "hours": hours,
        "verdict": verdict,
        "verdicts_right": int(verdict == truth.verdict),
        "verdicts": 1,
    }


def _scores(
    document: Mapping[str, Any],
    truth: MissionTruth,
    recorder: MissionRecorder,
    overlaps: ObjectOverlaps,
) -> dict[str, Any]:
    identified, scored = identity_counts(truth, recorder, overlaps)
    poses = reported_poses(truth, recorder, overlaps)
    scores: dict[str, Any] = {
        "identity": identified / scored if scored else None,
        "identity_counts": [identified, scored],
        **report_scores(truth, recorder, true_names(overlaps)),
        "view_deg": view_error(document, poses),
        "spin_error": spin_error(document, poses),
        "fps": len(recorder.objects_by_frame) / recorder.seconds if recorder.seconds else None,
    }
    return {k: v for k, v in scores.items() if v is not None}


def mission_total(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures over all missions from summed counts, so that each frame and event has equal weight."""
    true_positives, false_positives, false_negatives = (
        sum(i["event_counts"][k] for i in items) for k in range(3)
    )
    precision, recall, f1 = precision_recall_f1(true_positives, false_positives, false_negatives)
    identified, scored = (sum(i["identity_counts"][k] for i in items) for k in range(2))
    hours = sum(i["hours"] for i in items)
    total: dict[str, Any] = {
        "identity": identified / scored if scored else None,
        "event_precision": precision,
        "event_recall": recall,
        "event_f1": f1,
        "stage": mean_of(items, "stage"),
        "failing_latency_s": max(
            (i["failing_latency_s"] for i in items if "failing_latency_s" in i), default=None
        ),
        "view_deg": mean_of(items, "view_deg"),
        "spin_error": mean_of(items, "spin_error"),
        "fps": mean_of(items, "fps"),
        "false_alerts_per_hour": sum(i["false_alerts"] for i in items) / hours if hours else None,
    }
    counts = ("alerts_found", "alerts_expected", "false_alerts", "verdicts_right", "verdicts")
    total |= sums_of(items, counts)
    return {k: v for k, v in total.items() if v is not None}
