"""Figures of a supervised mission against its truth, as pure functions.

The definitions are those of the mission data's README: identity, events, stages, latency, alerts, verdict,
view. Reports (`ReportedEvent`, `StageSample`) and truth (`MissionTruth`) are plain records and are compared
only here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

SCORED_EVENTS = ("entry", "exit", "occlusion", "reappearance", "coupled", "decoupled")
UNSCORED_START_S = 2.0
"""Entries within this time from the start are not scored, nor identities within it from an entry, seconds."""
EVENT_TOLERANCE_S = 1.0
ALERT_TOLERANCE_S = 3.0
CHANGE_MARGIN_S = 1.0
"""Time before and after a change of the true stage in which stages are not scored, seconds."""


@dataclass(frozen=True, slots=True)
class TrueStage:
    """A true stage: name, span in seconds, outcome."""

    stage: str
    from_s: float
    to_s: float
    outcome: str


@dataclass(frozen=True, slots=True)
class TrueEvent:
    """A true event: kind, objects by name, time in seconds."""

    kind: str
    objects: frozenset[str]
    time: float


@dataclass(frozen=True, slots=True)
class TrueAlert:
    """An expected alert: kind, begin, objects by name (empty for any)."""

    kind: str
    from_s: float
    objects: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class MissionTruth:
    """The ground truth of a mission."""

    events: tuple[TrueEvent, ...]
    stages: tuple[TrueStage, ...]
    alerts: tuple[TrueAlert, ...]
    verdict: str
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ReportedEvent:
    """A reported event or alert: kind, true names of its objects, time, severity.

    An object without a true counterpart is named '?'.
    """

    kind: str
    objects: frozenset[str]
    time: float
    severe: bool = False  # an alert of severity warning or above


@dataclass(frozen=True, slots=True)
class StageSample:
    """The report at one time: the current stage and its outcome so far, or None."""

    time: float
    stage: str | None
    outcome: str | None


def parse_truth(truth: Mapping[str, object], fps: float) -> MissionTruth:
    """Parse the truth of a mission from its `truth.json`.

    Args:
        truth: The parsed file.
        fps: Frames per second, to convert frame numbers to seconds.
    """
    document: Mapping[str, list[dict[str, object]]] = truth  # type: ignore[assignment]
    events = tuple(
        TrueEvent(str(e["kind"]), _objects(e), float(str(e["frame"])) / fps)
        for e in document["events"]
    )
    stages = tuple(
        TrueStage(
            str(s["stage"]), float(str(s["from_s"])), float(str(s["to_s"])), str(s["outcome"])
        )
        for s in document["stages"]
    )
    alerts = tuple(
        TrueAlert(str(a["kind"]), float(str(a["from_s"])), _objects(a)) for a in document["alerts"]
    )
    meshes: Mapping[str, str] = truth.get("meshes", {})  # type: ignore[assignment]
    return MissionTruth(events, stages, alerts, str(truth["verdict"]), meshes)


def _objects(entry: Mapping[str, object]) -> frozenset[str]:
    if "objects" in entry:
        return frozenset(entry["objects"])  # type: ignore[call-overload, no-any-return]
    return frozenset({str(entry["object"])}) if "object" in entry else frozenset()


def matched_events(
    reported: Sequence[ReportedEvent], ground_truth: Sequence[TrueEvent]
) -> tuple[int, int, int]:
    """Match reported events to true ones, and count correct, excess and missed ones.

    An event is correct if kind and objects agree and it is within a second; each true event is matched once,
    the nearest report first. Entries in the first two seconds are not scored on either side.

    Returns:
        (true positives, false positives, false negatives).
    """
    scored_reports = [
        t for t in reported if t.kind in SCORED_EVENTS and not _is_start(t.kind, t.time)
    ]
    scored_truth = [
        t for t in ground_truth if t.kind in SCORED_EVENTS and not _is_start(t.kind, t.time)
    ]
    pairs = sorted(
        (abs(a.time - b.time), i, j)
        for i, a in enumerate(scored_reports)
        for j, b in enumerate(scored_truth)
        if a.kind == b.kind
        and a.objects == b.objects
        and abs(a.time - b.time) <= EVENT_TOLERANCE_S + 1e-9
    )
    used_reports: set[int] = set()
    used_truth: set[int] = set()
    for _, i, j in pairs:
        if i not in used_reports and j not in used_truth:
            used_reports.add(i)
            used_truth.add(j)
    true_positives = len(used_reports)
    return true_positives, len(scored_reports) - true_positives, len(scored_truth) - true_positives


def _is_start(kind: str, time: float) -> bool:
    return kind == "entry" and time < UNSCORED_START_S


def precision_recall_f1(
    true_positives: int, false_positives: int, false_negatives: int
) -> tuple[float, float, float]:
    """Precision, recall and F1 of counts; 1 without reports or without truth."""
    precision = (
        true_positives / (true_positives + false_positives)
        if true_positives + false_positives
        else 1.0
    )
    recall = (
        true_positives / (true_positives + false_negatives)
        if true_positives + false_negatives
        else 1.0
    )
    denominator = precision + recall
    return precision, recall, 2 * precision * recall / denominator if denominator else 0.0


def true_outcome(truth: MissionTruth, time: float) -> tuple[str, str] | None:
    """The true stage at a time and its outcome so far; None outside the listed stages."""
    for stage in truth.stages:
        if stage.from_s <= time < stage.to_s:
            failure_time = _failure_time(stage, truth.alerts)
            failed = failure_time is not None and time >= failure_time
            return stage.stage, stage.outcome if failed else "progressing"
    return None


def _failure_time(stage: TrueStage, alerts: Iterable[TrueAlert]) -> float | None:
    """When a stage goes wrong: at the first alert within it, or at its start if there is none."""
    if stage.outcome == "complete":
        return None
    alert_times = [a.from_s for a in alerts if stage.from_s <= a.from_s < stage.to_s]
    return min(alert_times, default=stage.from_s)


def changes(truth: MissionTruth) -> list[float]:
    """Times at which the true (stage, outcome so far) changes, around which nothing is scored."""
    times = {t for s in truth.stages for t in (s.from_s, s.to_s)}
    failure_times = (_failure_time(s, truth.alerts) for s in truth.stages)
    return sorted(times | {t for t in failure_times if t is not None})


def stage_share(samples: Sequence[StageSample], truth: MissionTruth) -> float | None:
    """Share of scored time with the correct (stage, outcome so far).

    Returns:
        0 to 1, or None without scored samples.
    """
    change_times = changes(truth)
    correct = scored = 0
    for sample in samples:
        expected = true_outcome(truth, sample.time)
        if expected is None or any(abs(sample.time - t) < CHANGE_MARGIN_S for t in change_times):
            continue
        scored += 1
        correct += (sample.stage, sample.outcome) == expected
    return correct / scored if scored else None


def failing_latency(samples: Sequence[StageSample], truth: MissionTruth) -> float | None:
    """The greatest delay from a true failure of a stage to its first report as failing.

    Returns:
        Seconds (negative if early), infinity if never reported, None if nothing fails.
    """
    delays = []
    for stage in truth.stages:
        if stage.outcome != "failing":
            continue
        failure_time = _failure_time(stage, truth.alerts)
        report_times = [
            s.time for s in samples if s.stage == stage.stage and s.outcome == "failing"
        ]
        delays.append(min(report_times, default=math.inf) - (failure_time or 0.0))
    return max(delays, default=None)


def scored_alerts(
    reported: Sequence[ReportedEvent], expected: Sequence[TrueAlert]
) -> tuple[int, int]:
    """Number of expected alerts that were found, and of severe false ones.

    Returns:
        (found, false alerts).
    """
    severe = [t for t in reported if t.severe]
    used: set[int] = set()
    found = 0
    for alert in expected:
        candidates = [
            (abs(t.time - alert.from_s), i)
            for i, t in enumerate(severe)
            if i not in used
            and t.kind == alert.kind
            and (not alert.objects or alert.objects == t.objects)
            and abs(t.time - alert.from_s) <= ALERT_TOLERANCE_S + 1e-9
        ]
        if candidates:
            used.add(min(candidates)[1])
            found += 1
    return found, len(severe) - len(used)
