"""Figures of a supervised clip against its truth, as pure functions.

The definitions are those of the data's README under `visup eval machines`. Reports (`MachineReport`) and
truth (`MachineTruth`) are plain records and are compared only here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from visup.evaluation.missions.scores import TrueStage, precision_recall_f1

INTERVAL_TOLERANCE_S = 1.0
MIN_ACTOR_IOU = 0.5
BAD_OUTCOMES = ("failing", "unsafe")

Box = tuple[float, ...]
"""(x, y, width, height), pixels."""

Counts = tuple[int, int, int]
"""True positives, false positives, false negatives.

"""


@dataclass(frozen=True, slots=True)
class Interval:
    """A contact of two, or a movement of one: ordered names; begin and end in seconds."""

    names: tuple[str, ...]
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class TrueBoxes:
    """Boxes of one frame by actor, without actors out of view."""

    frame: int
    boxes: Mapping[str, Box]


@dataclass(frozen=True, slots=True)
class MachineTruth:
    """The ground truth of a clip.

    Attributes:
        stages: Stages in order.
        accept: All correct verdicts.
        tolerance_s: Tolerance of the beginning of a stage, seconds.
        boxes: Boxes at some frames.
        contacts: Contacts, or None if not annotated.
        moves: Movements, or None if not annotated.
    """

    stages: tuple[TrueStage, ...]
    accept: frozenset[str]
    tolerance_s: float
    boxes: tuple[TrueBoxes, ...] = ()
    contacts: tuple[Interval, ...] | None = None
    moves: tuple[Interval, ...] | None = None


@dataclass(frozen=True, slots=True)
class ReportedStage:
    """A reported stage.

    Attributes:
        stage: Its name.
        time: When its beginning was reported, seconds.
        outcome: Its final outcome.
        began: When it began according to that report, seconds; None for the time of the report.
    """

    stage: str
    time: float
    outcome: str
    began: float | None = None

    @property
    def dated(self) -> ReportedStage:
        """The same stage as if it had been reported when it began."""
        return self if self.began is None else replace(self, time=self.began, began=None)


@dataclass(frozen=True, slots=True)
class ReportedAlert:
    """An alert of severity warning or above: kind, its stage or '', time of opening."""

    kind: str
    stage: str
    time: float


@dataclass(frozen=True, slots=True)
class MachineReport:
    """The reports of a supervisor for a clip.

    Attributes:
        verdict: Final verdict.
        stages: Stages by time.
        boxes: Frame -> actor -> box of its region.
        contacts: Contacts.
        moves: Movements.
        alerts: Alerts of severity warning or above.
        seconds: Length of the watched part.
        ms: Median time per frame.
    """

    verdict: str
    stages: tuple[ReportedStage, ...] = ()
    boxes: Mapping[int, Mapping[str, Box]] | None = None
    contacts: tuple[Interval, ...] = ()
    moves: tuple[Interval, ...] = ()
    alerts: tuple[ReportedAlert, ...] = ()
    seconds: float = 0.0
    ms: float | None = None


def machine_scores(report: MachineReport, truth: MachineTruth) -> dict[str, Any]:
    """Figures of one clip by the keys of the data's README, and the underlying counts.

    Truth after the end of the watched part is not scored.
    """
    end = report.seconds if report.seconds > 0.0 else float("inf")
    stages = [s for s in truth.stages if s.from_s <= end]
    dated = [s.dated for s in report.stages]
    box_counts = actor_counts(report.boxes or {}, truth.boxes)
    scores: dict[str, Any] = {
        "stage_counts": list(matched_stages(report.stages, stages, truth.tolerance_s)),
        "stage_dated_counts": list(matched_stages(dated, stages, truth.tolerance_s)),
        "actor_counts": list(box_counts),
        "false_alerts": false_alerts(report.alerts, truth),
        "minutes": max(report.seconds, 1.0) / 60,
        "verdict": report.verdict,
        "told": [f"{s.stage} {s.time:.1f} {s.outcome}" for s in report.stages],
        "began": [s.dated.time for s in report.stages],
    }
    if truth.accept:
        scores |= {"verdicts_right": int(report.verdict in truth.accept), "verdicts": 1}
    if truth.contacts is not None:
        counts = matched_intervals(report.contacts, _begun_before(truth.contacts, end))
        scores["contact_counts"] = list(counts)
    if truth.moves is not None:
        scores["move_counts"] = list(
            matched_intervals(report.moves, _begun_before(truth.moves, end))
        )
    if report.ms is not None:
        scores["ms"] = report.ms
    return scores | figures_of(scores)


def _begun_before(intervals: Sequence[Interval], end: float) -> list[Interval]:
    """Intervals that begin before the end, cut at the end."""
    return [Interval(i.names, i.from_s, min(i.to_s, end)) for i in intervals if i.from_s < end]


def figures_of(counted: Mapping[str, Any]) -> dict[str, Any]:
    """The figures from counts, of one clip or of all."""
    figures: dict[str, Any] = {}
    if sum(counted["stage_counts"]):
        names = ("stage_precision", "stage_recall", "stage_f1")
        figures |= dict(zip(names, precision_recall_f1(*counted["stage_counts"]), strict=True))
        figures["stage_dated_f1"] = precision_recall_f1(*counted["stage_dated_counts"])[2]
    if counted["actor_counts"][1]:
        figures["actors"] = counted["actor_counts"][0] / counted["actor_counts"][1]
    for kind in ("contact", "move"):
        counts = counted.get(f"{kind}_counts", (0, 0, 0))
        if sum(counts):
            figures[f"{kind}_f1"] = precision_recall_f1(*counts)[2]
    figures["false_alerts_per_min"] = counted["false_alerts"] / counted["minutes"]
    return figures


def machine_total(items: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures over all clips from summed counts, so that each stage, box and interval has equal weight."""
    total: dict[str, Any] = {
        key: [sum(i.get(key, (0,) * width)[k] for i in items) for k in range(width)]
        for key, width in COUNT_WIDTHS.items()
    }
    for key in ("false_alerts", "minutes", "verdicts_right", "verdicts"):
        total[key] = sum(i.get(key, 0) for i in items)
    times = [i["ms"] for i in items if "ms" in i]
    if times:
        total["ms"] = sum(times) / len(times)
    return total | (figures_of(total) if items else {})


COUNT_WIDTHS = {
    "stage_counts": 3,
    "stage_dated_counts": 3,
    "actor_counts": 2,
    "contact_counts": 3,
    "move_counts": 3,
}


def matched_stages(
    reported: Sequence[ReportedStage], ground_truth: Sequence[TrueStage], tolerance_s: float
) -> Counts:
    """Stages reported in time, in the correct order, with the correct outcome.

    Args:
        reported: Reported stages by time.
        ground_truth: True stages in order.
        tolerance_s: Tolerance of the beginning, seconds.

    Returns:
        True positives, false positives and false negatives of the longest common subsequence.
    """

    def agree(a: ReportedStage, b: TrueStage) -> bool:
        near = abs(a.time - b.from_s) <= tolerance_s + 1e-9
        return near and a.stage == b.stage and a.outcome == b.outcome

    true_positives = longest_common(reported, ground_truth, agree)
    return true_positives, len(reported) - true_positives, len(ground_truth) - true_positives


A = TypeVar("A")
B = TypeVar("B")


def longest_common(first: Sequence[A], second: Sequence[B], same: Callable[[A, B], bool]) -> int:
    """Length of the longest common subsequence."""
    previous_row = [0] * (len(second) + 1)
    for a in first:
        row = [0]
        for k, b in enumerate(second):
            row.append(max(previous_row[k] + same(a, b), previous_row[k + 1], row[k]))
        previous_row = row
    return previous_row[-1]


def matched_intervals(reported: Sequence[Interval], ground_truth: Sequence[Interval]) -> Counts:
    """Intervals of the same objects whose begins and ends agree within a second, one to one.

    Intervals of the same objects are matched in order.
    """
    true_positives = 0
    for names in sorted({i.names for i in ground_truth}):
        reported_spans = sorted((i.from_s, i.to_s) for i in reported if i.names == names)
        true_spans = sorted((i.from_s, i.to_s) for i in ground_truth if i.names == names)
        true_positives += longest_common(reported_spans, true_spans, _agree)
    return true_positives, len(reported) - true_positives, len(ground_truth) - true_positives


def _agree(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return all(abs(x - y) <= INTERVAL_TOLERANCE_S + 1e-9 for x, y in zip(a, b, strict=True))


def actor_counts(
    reported: Mapping[int, Mapping[str, Box]], ground_truth: Sequence[TrueBoxes]
) -> tuple[int, int]:
    """Number of annotated boxes covered by a region with the actor's name, and of all in watched frames."""
    covered = scored = 0
    for row in ground_truth:
        if row.frame not in reported:
            continue
        for name, box in row.boxes.items():
            scored += 1
            reported_box = reported[row.frame].get(name)
            covered += reported_box is not None and box_iou(reported_box, box) >= MIN_ACTOR_IOU
    return covered, scored


def box_iou(a: Box, b: Box) -> float:
    """Intersection over union of two boxes, 0 to 1."""
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    intersection = max(0.0, width) * max(0.0, height)
    return intersection / (a[2] * a[3] + b[2] * b[3] - intersection)


def false_alerts(alerts: Sequence[ReportedAlert], truth: MachineTruth) -> int:
    """Number of alerts not explained by a stage that truly goes wrong."""
    return sum(not _is_explained(alert, truth) for alert in alerts)


def _is_explained(alert: ReportedAlert, truth: MachineTruth) -> bool:
    """Whether a stage that goes wrong has begun, and the alert is about that stage or its violation."""
    for stage in truth.stages:
        has_begun = alert.time >= stage.from_s - truth.tolerance_s - 1e-9
        if stage.outcome not in BAD_OUTCOMES or not has_begun:
            continue
        if alert.kind == "stage_failing":
            if alert.stage == stage.stage:
                return True
        elif alert.kind == "invariant_broken" or stage.outcome == "unsafe":
            return True
    return False
