"""Laws of the figures: a perfect report scores 1, nothing scores more, what is off scores less."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.evaluation.machines.scores import (
    Interval,
    MachineReport,
    MachineTruth,
    ReportedAlert,
    ReportedStage,
    TrueBoxes,
    box_iou,
    false_alerts,
    longest_common,
    machine_scores,
    machine_total,
    matched_intervals,
    matched_stages,
)
from visup.evaluation.missions.scores import TrueStage

STAGES = (
    TrueStage("reach", 1.0, 3.0, "complete"),
    TrueStage("grasp", 3.0, 5.0, "complete"),
    TrueStage("carry", 5.0, 9.0, "failing"),
)
TRUTH = MachineTruth(
    stages=STAGES,
    accept=frozenset({"failed"}),
    tolerance_s=0.7,
    boxes=(TrueBoxes(0, {"part": (10, 10, 20, 20)}), TrueBoxes(30, {"part": (40, 10, 20, 20)})),
    contacts=(Interval(("gripper", "part"), 3.0, 7.0),),
    moves=(Interval(("part",), 5.0, 9.0),),
)
PERFECT = MachineReport(
    verdict="failed",
    stages=tuple(ReportedStage(s.stage, s.from_s, s.outcome) for s in STAGES),
    boxes={row.frame: row.boxes for row in TRUTH.boxes},
    contacts=TRUTH.contacts or (),
    moves=TRUTH.moves or (),
    seconds=10.0,
    ms=5.0,
)
F1S = ("stage_f1", "actors", "contact_f1", "move_f1")


def shifted(report: MachineReport, by: float) -> MachineReport:
    """The same, told later."""
    return replace(
        report,
        stages=tuple(replace(s, time=s.time + by) for s in report.stages),
        contacts=tuple(Interval(i.names, i.from_s + by, i.to_s + by) for i in report.contacts),
        moves=tuple(Interval(i.names, i.from_s + by, i.to_s + by) for i in report.moves),
    )


def test_a_perfect_report_scores_one_everywhere() -> None:
    scores = machine_scores(PERFECT, TRUTH)
    assert [scores[k] for k in F1S] == [1.0] * 4
    assert (scores["verdicts_right"], scores["false_alerts_per_min"]) == (1, 0.0)


@given(st.floats(-0.69, 0.69))
def test_within_the_tolerance_nothing_is_lost(by: float) -> None:
    scores = machine_scores(shifted(PERFECT, by), TRUTH)
    assert scores["stage_f1"] == scores["contact_f1"] == scores["move_f1"] == 1.0


@pytest.mark.parametrize("by", [-0.8, 0.8])
def test_beyond_the_tolerance_no_stage_counts(by: float) -> None:
    assert machine_scores(shifted(PERFECT, by), TRUTH)["stage_f1"] == 0.0


def test_a_late_report_is_wrong_even_if_it_states_the_true_beginning() -> None:
    late = tuple(replace(s, time=s.time + 2.0, began=s.time) for s in PERFECT.stages)
    scores = machine_scores(replace(PERFECT, stages=late), TRUTH)
    assert (scores["stage_f1"], scores["stage_dated_f1"]) == (0.0, 1.0)
    assert machine_total([scores])["stage_dated_f1"] == 1.0


@pytest.mark.parametrize("by", [-1.1, 1.1])
def test_beyond_a_second_no_interval_counts(by: float) -> None:
    scores = machine_scores(shifted(PERFECT, by), TRUTH)
    assert scores["contact_f1"] == scores["move_f1"] == 0.0


def test_an_empty_report_has_no_recall_but_full_precision() -> None:
    scores = machine_scores(MachineReport("unknown", boxes={0: {}, 30: {}}, seconds=10.0), TRUTH)
    assert [scores[k] for k in F1S] == [0.0] * 4
    assert scores["stage_precision"] == 1.0


def test_a_wrong_outcome_makes_a_stage_wrong() -> None:
    reported = (*PERFECT.stages[:2], ReportedStage("carry", 5.0, "complete"))
    assert matched_stages(reported, STAGES, 0.7) == (2, 1, 1)


def test_stages_in_the_wrong_order_do_not_match() -> None:
    ground_truth = [TrueStage("a", 1.0, 1.2, "complete"), TrueStage("b", 1.2, 2.0, "complete")]
    reported = [ReportedStage("b", 1.0, "complete"), ReportedStage("a", 1.3, "complete")]
    assert matched_stages(reported, ground_truth, 0.7) == (1, 1, 1)


def test_each_true_stage_counts_once() -> None:
    reported = [ReportedStage("reach", t, "complete") for t in (0.8, 1.0, 1.2)]
    assert matched_stages(reported, STAGES, 0.7) == (1, 2, 2)


words = st.lists(st.sampled_from("ab"), max_size=6)


@given(words, words)
def test_the_longest_common_subsequence_agrees_with_brute_force(
    first: list[str], second: list[str]
) -> None:
    def subsequences(word: list[str]) -> set[str]:
        every = (combinations(word, n) for n in range(len(word) + 1))
        return {"".join(c) for row in every for c in row}

    longest = max(map(len, subsequences(first) & subsequences(second)))
    assert longest_common(first, second, str.__eq__) == longest


def test_intervals_of_other_objects_do_not_match() -> None:
    other = [Interval(("gripper", "tray"), 3.0, 7.0)]
    assert matched_intervals(other, TRUTH.contacts or ()) == (0, 1, 1)


boxes = st.tuples(*[st.floats(-20, 20)] * 2, *[st.floats(1, 30)] * 2)


@given(boxes, boxes)
def test_the_overlap_of_boxes_is_symmetric_and_one_with_itself(
    a: tuple[float, ...], b: tuple[float, ...]
) -> None:
    assert box_iou(a, b) == pytest.approx(box_iou(b, a))
    assert 0.0 <= box_iou(a, b) <= 1.0 + 1e-9
    assert box_iou(a, a) == pytest.approx(1.0)


def test_frames_that_were_not_watched_are_not_scored() -> None:
    scores = machine_scores(replace(PERFECT, boxes={0: {"part": (10, 10, 20, 20)}}), TRUTH)
    assert scores["actors"] == 1.0
    assert scores["actor_counts"] == [1, 1]


@pytest.mark.parametrize(
    ("alert", "false"),
    [
        (ReportedAlert("stage_failing", "carry", 6.0), 0),  # of the stage that truly fails
        (ReportedAlert("stage_failing", "carry", 4.5), 0),  # within the tolerance
        (ReportedAlert("stage_failing", "carry", 3.0), 1),  # long before it begins
        (ReportedAlert("stage_failing", "grasp", 6.0), 1),  # of another stage
        (ReportedAlert("invariant_broken", "", 6.0), 0),  # what the failing stage breaks
        (ReportedAlert("unexpected_object", "", 6.0), 1),  # nothing to do with it
    ],
)
def test_alerts_of_a_stage_that_truly_fails_are_not_false(alert: ReportedAlert, false: int) -> None:
    assert false_alerts([alert], TRUTH) == false


def test_any_alert_is_false_in_a_faultless_run() -> None:
    faultless = replace(TRUTH, stages=STAGES[:2])
    assert false_alerts([ReportedAlert("stage_failing", "carry", 6.0)], faultless) == 1


def test_all_accepted_verdicts_are_right() -> None:
    truth = replace(TRUTH, accept=frozenset({"failed", "in_progress"}))
    scores = [
        machine_scores(replace(PERFECT, verdict=v), truth) for v in ("in_progress", "unknown")
    ]
    assert [s["verdicts_right"] for s in scores] == [1, 0]


def test_each_stage_has_equal_weight_in_the_total() -> None:
    nothing = machine_scores(MachineReport("unknown", seconds=10.0), TRUTH)
    total = machine_total([machine_scores(PERFECT, TRUTH), nothing])
    assert total["stage_recall"] == 0.5
    assert (total["verdicts_right"], total["verdicts"]) == (1, 2)


def test_truth_after_the_watched_part_is_not_scored() -> None:
    short = machine_scores(replace(PERFECT, stages=PERFECT.stages[:1], seconds=2.0), TRUTH)
    assert short["stage_f1"] == 1.0
