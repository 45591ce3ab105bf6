"""Dense time: equal to an oracle cell by cell, online as offline, at a cost that windows do not change."""

import time
from math import inf
from random import Random
from typing import Literal

import pytest

from tests.oracles.dense_formulas import dense_formula, held, random_recording
from tests.oracles.dense_oracle import CELL_MS, DenseOracle
from tests.oracles.reasoning.rules import alike
from visup.agent.model.errors import RuleError, SettingsError
from visup.rules.dense_time import DenseTimeMonitor, Ends, judge_recording
from visup.rules.dense_time.monitor import TimedVerdict
from visup.rules.language.parser import parse_formula
from visup.rules.monitoring.intervals import Interval, verdict
from visup.rules.monitoring.monitor import Monitor
from visup.rules.predicates.vocabulary import signals


def at(verdicts: list[TimedVerdict], moment: float) -> Interval:
    (found,) = (v.robustness for v in verdicts if v.begin_s <= moment < v.end_s)
    return found


@pytest.mark.parametrize("block", range(4))
def test_random_formulas_are_what_the_oracle_says_in_every_cell(block: int) -> None:
    for seed in range(120 * block, 120 * block + 120):
        rng = Random(f"dense {seed}")
        formula, cut = dense_formula(rng, rng.randint(1, 3)), rng.random() < 0.5
        samples = random_recording(rng, rng.randint(2, 14))
        truth = DenseOracle(held(samples), cut).cells(formula)
        ends: Literal["cut", "unknown"] = "cut" if cut else "unknown"
        told = judge_recording(
            formula,
            [(k * CELL_MS / 1000, v) for k, v in samples],
            ends=Ends(ends, ends),
            end_s=len(truth) * CELL_MS / 1000,
        )
        mine = [at(told, k * CELL_MS / 1000) for k in range(len(truth))]
        assert all(map(alike, mine, truth)), f"{seed}: {formula}"


def test_over_regular_samples_it_is_what_the_monitor_says() -> None:
    for seed in range(150):
        rng = Random(f"regular {seed}")
        formula = dense_formula(rng, rng.randint(1, 3))
        if "true" in str(formula) or "false" in str(formula) or "==" in str(formula):
            continue  # of these something is known before the first sample; Monitor says nothing of it
        samples = [
            (k * CELL_MS / 1000, {n: rng.randint(-8, 8) / 4 for n in "xy"}) for k in range(25)
        ]
        told = judge_recording(formula, samples, "samples")
        monitor = Monitor(formula)
        late = round(monitor.delay * 1000 / CELL_MS)
        online = [monitor.step(t, v) for t, v in samples][late:]
        mine = [at(told, t) for t, _ in samples[: len(online)]]
        assert all(map(alike, mine, online)), f"{seed}: {formula}"


TEXTS = {
    # The inner window becomes false between samples, and the outer one knows.
    "(x() > 0 within 0.3 s) for 0.2 s": [(0.0, 0.9, False), (0.9, 1.1, True), (1.1, 2.0, False)],
    "eventually[0.5 s] x() > 0": [(0.0, 0.2, False), (0.2, 0.8, True), (0.8, 1.5, False)],
    "x() > 0 for 0.1 s to 0.1 s ago": [
        (0.0, 0.1, True),
        (0.1, 0.8, False),
        (0.8, 0.9, True),
        (0.9, 2.0, False),
    ],
}


@pytest.mark.parametrize("text", TEXTS)
def test_what_changes_between_samples_is_told_to_the_microsecond(text: str) -> None:
    samples = [(0.0, {"x": -1}), (0.7, {"x": 1}), (0.8, {"x": -1}), (2.0, {"x": -1})]
    told = judge_recording(parse_formula(text, signals("x")), samples, ends=Ends("cut", "cut"))
    for begin, end, truth in TEXTS[text]:
        for moment in (begin, end - 1e-6):
            assert (verdict(at(told, moment)).value == "true") is truth, (begin, end)


def test_a_straight_signal_changes_its_verdict_where_it_crosses() -> None:
    told = judge_recording(
        parse_formula("2 * x() - 1 > 0", signals("x")), [(0, {"x": 0}), (1, {"x": 2})], "linear"
    )
    assert [(v.begin_s, v.end_s, v.robustness[0]) for v in told] == [
        (0, 0.25, -inf),
        (0.25, 1.000001, inf),
    ]


@pytest.mark.parametrize(
    ("ends", "expected"), [("unknown", "unknown"), ("cut", "false"), ("lasting", "false")]
)
def test_the_end_of_a_recording_is_read_as_one_chooses(ends: str, expected: str) -> None:
    formula = parse_formula("eventually[1 s .. 2 s] x() > 0", signals("x"))
    told = judge_recording(formula, [(0.0, {"x": 1}), (0.5, {"x": -1})], ends=Ends(after=ends))  # type: ignore[arg-type]
    assert verdict(at(told, 0.5)).value == expected
    always = parse_formula("henceforth[1 s .. 2 s] x() > 0", signals("x"))
    weak = judge_recording(always, [(0.0, {"x": 1}), (0.5, {"x": 1})], ends=Ends(after=ends))  # type: ignore[arg-type]
    assert verdict(at(weak, 0.5)).value == {"unknown": "unknown"}.get(ends, "true")


def test_a_formula_stays_decided_in_a_silence_while_its_window_decides_it() -> None:
    formula = parse_formula("(x() > 0 within 3 s) for 1 s", signals("x"))
    samples = [(0.0, {"x": 1}), (1.0, {"x": -1}), (5.0, {"x": -1})]
    told = judge_recording(formula, samples, ends=Ends(hold_s=0.5))
    values = [verdict(at(told, t)).value for t in (1.5, 2.5, 4.0)]
    assert values == ["true", "true", "unknown"]


def test_each_moment_is_told_once_as_soon_as_it_is_decided() -> None:
    rng, seen = Random(3), 0.0
    monitor = DenseTimeMonitor(parse_formula("x() > 1 until[0.4 s] x() > 2", signals("x")))
    for k in range(200):
        for told in monitor.step(k * 0.05, {"x": rng.random() * 3}):
            assert told.begin_s == pytest.approx(seen)
            seen = told.end_s
        assert seen >= k * 0.05 - monitor.delay - 1e-9
    assert [v.end_s for v in monitor.finish()][-1] == pytest.approx(199 * 0.05 + 1e-6)


def test_the_cost_of_a_sample_does_not_grow_with_the_window() -> None:
    def cost(window: int) -> float:
        rng = Random(1)
        monitor = DenseTimeMonitor(
            parse_formula(f"x() > 0.5 since[{window} s] x() > 0.9", signals("x"))
        )
        for k in range(2 * window * 10):
            monitor.step(k * 0.1, {"x": rng.random()})
        best = inf
        for part in range(3):
            begin = time.process_time()
            for k in range(400):
                monitor.step((2 * window * 10 + part * 400 + k) * 0.1, {"x": rng.random()})
            best = min(best, time.process_time() - begin)
        return best

    assert cost(200) < 4 * cost(5)


@pytest.mark.parametrize(
    ("text", "reading"),
    [
        ("x() > 0 in 3 of 5 samples", "held"),
        ("x() > 0 in 60 % of 2 s", "held"),
        ("previous x() > 0", "held"),
        ("abs(x()) > 0", "linear"),
    ],
)
def test_what_has_no_value_between_samples_is_refused(text: str, reading: str) -> None:
    with pytest.raises(RuleError):
        DenseTimeMonitor(parse_formula(text, signals("x")), reading)  # type: ignore[arg-type]


def test_times_must_increase() -> None:
    monitor = DenseTimeMonitor(parse_formula("x() > 0", signals("x")))
    monitor.step(1.0, {"x": 1})
    with pytest.raises(SettingsError, match="comes after"):
        monitor.step(1.0, {"x": 1})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("eventually[60 s] x() > 0", ["unknown", "unknown", "true", "unknown"]),
        ("henceforth[60 s] x() > 0", ["false", "false", "unknown", "false"]),
        ("x() > 0 within 0.3 s", ["unknown", "unknown", "true", "true"]),
        ("(eventually[9 s] x() > 0) and x() > -3", ["unknown", "unknown", "true", "unknown"]),
    ],
)
def test_what_is_decided_already_need_not_be_waited_for(text: str, expected: list[str]) -> None:
    monitor, other = (DenseTimeMonitor(parse_formula(text, signals("x"))) for _ in range(2))
    told = []
    for k, x in enumerate((-1, -2, 4, -1)):
        monitor.step(k * 0.1, {"x": x})
        other.step(k * 0.1, {"x": x})
        told.append(verdict(monitor.foreseen()).value)
    assert told == expected
    assert monitor.step(90.0, {"x": 1}) == other.step(90.0, {"x": 1})  # asking has changed nothing
