from __future__ import annotations

import math
from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.evaluation.missions.scores import (
    EVENT_TOLERANCE_S,
    MissionTruth,
    ReportedEvent,
    StageSample,
    TrueAlert,
    TrueEvent,
    TrueStage,
    failing_latency,
    matched_events,
    parse_truth,
    precision_recall_f1,
    scored_alerts,
    stage_share,
    true_outcome,
)

A, B = frozenset({"a"}), frozenset({"b"})
FAILS = MissionTruth(
    events=(),
    stages=(TrueStage("approach", 2, 12, "complete"), TrueStage("captured", 12, 30, "failing")),
    alerts=(TrueAlert("stage_failing", 12.8),),
    verdict="failed",
)
UNSAFE = MissionTruth(
    events=(),
    stages=(TrueStage("approach", 2, 20, "unsafe"),),
    alerts=(TrueAlert("unexpected_object", 7), TrueAlert("collision_course", 9, A | B)),
    verdict="interrupted",
)

times = st.integers(0, 12).map(lambda n: n / 2)
reported_events = st.lists(
    st.builds(ReportedEvent, st.sampled_from(["exit", "entry"]), st.sampled_from([A, B]), times),
    max_size=5,
)
true_events = st.lists(
    st.builds(TrueEvent, st.sampled_from(["exit", "entry"]), st.sampled_from([A, B]), times),
    max_size=4,
)


def max_matches(reported: list[ReportedEvent], true: list[TrueEvent]) -> int:
    """Brute force: the largest number of events that any pairing makes right."""
    scored_reports = [t for t in reported if not (t.kind == "entry" and t.time < 2)]
    scored_truth = [t for t in true if not (t.kind == "entry" and t.time < 2)]
    if len(scored_reports) < len(scored_truth):
        scored_reports = [
            *scored_reports,
            *[ReportedEvent("none", frozenset(), 0.0)] * (len(scored_truth) - len(scored_reports)),
        ]
    return max(
        sum(
            a.kind == b.kind
            and a.objects == b.objects
            and abs(a.time - b.time) <= EVENT_TOLERANCE_S
            for a, b in zip(order, scored_truth, strict=False)
        )
        for order in permutations(scored_reports, len(scored_truth))
    )


@given(reported_events, true_events)
def test_events_are_matched_once_each_and_nearly_as_well_as_any_pairing(
    reported: list[ReportedEvent], true: list[TrueEvent]
) -> None:
    matched, excess, missed = matched_events(reported, true)
    scored = [t for t in reported if not (t.kind == "entry" and t.time < 2)]
    scored_truth = [t for t in true if not (t.kind == "entry" and t.time < 2)]
    assert matched + excess == len(scored)
    assert matched + missed == len(scored_truth)
    best = max_matches(reported, true)
    assert best / 2 <= matched <= best  # nearest first is at least half of the best pairing


@given(true_events)
def test_reporting_the_truth_scores_one(true: list[TrueEvent]) -> None:
    counts = matched_events([ReportedEvent(e.kind, e.objects, e.time) for e in true], true)
    assert counts[1:] == (0, 0)
    assert precision_recall_f1(*counts) == (1.0, 1.0, 1.0)


def test_entries_in_the_first_two_seconds_count_on_neither_side() -> None:
    assert matched_events([ReportedEvent("entry", A, 0.5)], [TrueEvent("entry", A, 0.0)]) == (
        0,
        0,
        0,
    )


def test_a_wrong_object_is_both_excess_and_missed() -> None:
    assert matched_events([ReportedEvent("exit", A, 5)], [TrueEvent("exit", B, 5)]) == (0, 1, 1)


@pytest.mark.parametrize(
    ("truths", "time", "expected"),
    [
        (FAILS, 1.0, None),
        (FAILS, 2.0, ("approach", "progressing")),
        (FAILS, 12.4, ("captured", "progressing")),
        (FAILS, 12.8, ("captured", "failing")),
        (FAILS, 30.0, None),
        (UNSAFE, 6.9, ("approach", "progressing")),
        (UNSAFE, 7.0, ("approach", "unsafe")),
    ],
)
def test_the_true_outcome_at_a_time(
    truths: MissionTruth, time: float, expected: tuple[str, str] | None
) -> None:
    assert true_outcome(truths, time) == expected


def samples(truths: MissionTruth, shift: float = 0.0) -> list[StageSample]:
    stage_samples = []
    for i in range(0, 800):
        t = i / 25
        outcome = true_outcome(truths, t - shift)
        stage_samples.append(StageSample(t, *(outcome or (None, None))))
    return stage_samples


@pytest.mark.parametrize("truths", [FAILS, UNSAFE])
def test_stages_reported_within_a_second_are_correct_and_later_ones_are_not(
    truths: MissionTruth,
) -> None:
    assert stage_share(samples(truths), truths) == 1.0
    assert stage_share(samples(truths, 0.9), truths) == 1.0
    late = stage_share(samples(truths, 3.0), truths)
    assert late is not None
    assert 0.5 < late < 1.0


def test_no_reports_score_zero_and_nothing_to_score_gives_none() -> None:
    silent = [StageSample(i / 25, None, None) for i in range(800)]
    assert stage_share(silent, FAILS) == 0.0
    assert stage_share(silent, MissionTruth((), (), (), "interrupted")) is None


def test_latency_of_failing() -> None:
    assert failing_latency(samples(FAILS, 0.4), FAILS) == pytest.approx(0.4, abs=0.04)
    assert failing_latency(samples(UNSAFE), FAILS) == math.inf
    assert failing_latency(samples(UNSAFE), UNSAFE) is None


@pytest.mark.parametrize(
    ("reported", "expected"),
    [
        ([], (0, 0)),
        (
            [
                ReportedEvent("unexpected_object", A, 8, True),
                ReportedEvent("collision_course", A | B, 11.9, True),
            ],
            (2, 0),
        ),
        ([ReportedEvent("unexpected_object", A, 8, False)], (0, 0)),
        ([ReportedEvent("unexpected_object", A, 10.5, True)], (0, 1)),
        ([ReportedEvent("collision_course", A, 9, True)], (0, 1)),
        (
            [
                ReportedEvent("unexpected_object", A, 7, True),
                ReportedEvent("unexpected_object", B, 7.5, True),
            ],
            (1, 1),
        ),
    ],
)
def test_expected_alerts_are_found_and_others_are_false(
    reported: list[ReportedEvent], expected: tuple[int, int]
) -> None:
    assert scored_alerts(reported, UNSAFE.alerts) == expected


def test_truth_is_parsed_from_its_file() -> None:
    parsed = parse_truth(
        {
            "events": [{"kind": "coupled", "objects": ["a", "b"], "frame": 50}],
            "stages": [{"stage": "s", "from_s": 1, "to_s": 2, "outcome": "complete"}],
            "alerts": [{"kind": "x", "from_s": 3}],
            "verdict": "failed",
            "meshes": {"a": "mesh_a"},
        },
        fps=25,
    )
    assert parsed.events == (TrueEvent("coupled", A | B, 2.0),)
    assert parsed.alerts == (TrueAlert("x", 3.0),)
    assert parsed.names == {"a": "mesh_a"}
