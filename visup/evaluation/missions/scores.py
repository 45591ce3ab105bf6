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
EVENT_TOLERANCE_S = 1.0
ALERT_TOLERANCE_S = 3.0
CHANGE_MARGIN_S = 1.0


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
    grave: bool = False


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
    given: Mapping[str, list[dict[str, object]]] = truth  # type: ignore[assignment]
    events = tuple(
        TrueEvent(str(e["kind"]), _objects(e), float(str(e["frame"])) / fps)
        for e in given["events"]
    )
    stages = tuple(
        TrueStage(
            str(s["stage"]), float(str(s["from_s"])), float(str(s["to_s"])), str(s["outcome"])
        )
        for s in given["stages"]
    )
    alerts = tuple(
        TrueAlert(str(a["kind"]), float(str(a["from_s"])), _objects(a)) for a in given["alerts"]
    )
    meshes: Mapping[str, str] = truth.get("meshes", {})  # type: ignore[assignment]
    return MissionTruth(events, stages, alerts, str(truth["verdict"]), meshes)


def _objects(entry: Mapping[str, object]) -> frozenset[str]:
    if "objects" in entry:
        return frozenset(entry["objects"])  # type: ignore[call-overload, no-any-return]
    return frozenset({str(entry["object"])}) if "object" in entry else frozenset()


def matched_events(
    told: Sequence[ReportedEvent], true: Sequence[TrueEvent]
) -> tuple[int, int, int]:
    """Count correct, excess and missed events.

    An event is correct if kind and objects agree and it is within a second; each true event is matched once,
    the nearest report first. Entries in the first two seconds are not scored on either side.

    Returns:
        (true positives, false positives, false negatives).
    """
    said = [t for t in told if t.kind in SCORED_EVENTS and not _is_start(t.kind, t.time)]
    real = [t for t in true if t.kind in SCORED_EVENTS and not _is_start(t.kind, t.time)]
    pairs = sorted(
        (abs(a.time - b.time), i, j)
        for i, a in enumerate(said)
        for j, b in enumerate(real)
        if a.kind == b.kind
        and a.objects == b.objects
        and abs(a.time - b.time) <= EVENT_TOLERANCE_S + 1e-9
    )
    used_said: set[int] = set()
    used_real: set[int] = set()
    for _, i, j in pairs:
        if i not in used_said and j not in used_real:
            used_said.add(i)
            used_real.add(j)
    right = len(used_said)
    return right, len(said) - right, len(real) - right


def _is_start(kind: str, time: float) -> bool:
    return kind == "entry" and time < UNSCORED_START_S


def precision_recall_f1(right: int, excess: int, missed: int) -> tuple[float, float, float]:
    """Precision, recall and F1 of counts; 1 without reports or without truth."""
    precision = right / (right + excess) if right + excess else 1.0
    recall = right / (right + missed) if right + missed else 1.0
    both = precision + recall
    return precision, recall, 2 * precision * recall / both if both else 0.0


def true_outcome(truths: MissionTruth, time: float) -> tuple[str, str] | None:
    """The true stage at a time and its outcome so far; None outside the listed stages."""
    for stage in truths.stages:
        if stage.from_s <= time < stage.to_s:
            turned = _turns_bad(stage, truths.alerts)
            bad = turned is not None and time >= turned
            return stage.stage, stage.outcome if bad else "progressing"
    return None


def _turns_bad(stage: TrueStage, alerts: Iterable[TrueAlert]) -> float | None:
    """When a stage goes wrong: at the first alert within it, or at its start if there is none."""
    if stage.outcome == "complete":
        return None
    within = [a.from_s for a in alerts if stage.from_s <= a.from_s < stage.to_s]
    return min(within, default=stage.from_s)


def changes(truths: MissionTruth) -> list[float]:
    """Times at which the true (stage, outcome so far) changes, around which nothing is scored."""
    times = {t for s in truths.stages for t in (s.from_s, s.to_s)}
    turned = (_turns_bad(s, truths.alerts) for s in truths.stages)
    return sorted(times | {t for t in turned if t is not None})


def stage_share(samples: Sequence[StageSample], truths: MissionTruth) -> float | None:
    """Share of scored time with the correct (stage, outcome so far).

    Returns:
        0 to 1, or None without scored samples.
    """
    pauses = changes(truths)
    right = scored = 0
    for sample in samples:
        true = true_outcome(truths, sample.time)
        if true is None or any(abs(sample.time - t) < CHANGE_MARGIN_S for t in pauses):
            continue
        scored += 1
        right += (sample.stage, sample.outcome) == true
    return right / scored if scored else None


def failing_latency(samples: Sequence[StageSample], truths: MissionTruth) -> float | None:
    """The greatest delay from a true failure of a stage to its first report as failing.

    Returns:
        Seconds (negative if early), infinity if never reported, None if nothing fails.
    """
    late = []
    for stage in truths.stages:
        if stage.outcome != "failing":
            continue
        turned = _turns_bad(stage, truths.alerts)
        said = [s.time for s in samples if s.stage == stage.stage and s.outcome == "failing"]
        late.append(min(said, default=math.inf) - (turned or 0.0))
    return max(late, default=None)


def scored_alerts(told: Sequence[ReportedEvent], true: Sequence[TrueAlert]) -> tuple[int, int]:
    """Number of expected alerts that were found, and of severe false ones.

    Returns:
        (found, false alerts).
    """
    grave = [t for t in told if t.grave]
    used: set[int] = set()
    found = 0
    for alert in true:
        hits = [
            (abs(t.time - alert.from_s), i)
            for i, t in enumerate(grave)
            if i not in used
            and t.kind == alert.kind
            and (not alert.objects or alert.objects == t.objects)
            and abs(t.time - alert.from_s) <= ALERT_TOLERANCE_S + 1e-9
        ]
        if hits:
            used.add(min(hits)[1])
            found += 1
    return found, len(grave) - len(used)
