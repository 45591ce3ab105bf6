"""Operators over time: equal to an oracle, for one signal and for objects that come and go."""

from collections.abc import Iterator
from math import inf
from random import Random
from typing import Any

import numpy as np
import pytest

from tests.oracles.reasoning.rules import alike
from tests.oracles.rule_formulas import (
    SIGNALS,
    random_formula,
    random_times,
    random_value,
)
from tests.oracles.rule_oracle import robustness
from visup.agent import Truth
from visup.agent.model.errors import SettingsError
from visup.rules.dense_time import DenseTimeMonitor
from visup.rules.formula.nodes import Formula, Predicate
from visup.rules.formula.units import ticks
from visup.rules.language.parser import parse_formula
from visup.rules.monitoring.compiler import Compiler
from visup.rules.monitoring.intervals import Interval, verdict
from visup.rules.monitoring.linker import LinkedProgram
from visup.rules.monitoring.monitor import Monitor
from visup.rules.monitoring.samples import max_samples
from visup.rules.monitoring.states import States
from visup.rules.predicates.vocabulary import signals
from visup.rules.safety.compiled_rules import CompiledRules
from visup.rules.safety.verdicts import reindexed_states

History = list[tuple[float, dict[str, Interval]]]


def history(rng: Random, times: list[float]) -> History:
    return [(t, {name: random_value(rng) for name in SIGNALS}) for t in times]


def judged(formula: Formula, samples: History) -> list[Interval]:
    monitor = Monitor(formula)
    return [monitor.step(t, values) for t, values in samples]


@pytest.mark.parametrize("block", range(4))
def test_random_formulas_with_random_gaps_are_what_the_oracle_says(block: int) -> None:
    for seed in range(200 * block, 200 * block + 200):
        rng = Random(f"online {seed}")
        formula = random_formula(rng, rng.randint(1, 3))
        samples = history(rng, random_times(rng, rng.randint(4, 20)))
        truth = robustness(formula, [(ticks(t), v) for t, v in samples])
        told = judged(formula, samples)
        assert all(map(alike, told, truth)), f"{seed}: {formula}"


def cast(rng: Random, count: int) -> Iterator[tuple[int, ...]]:
    """Objects that are there, sample by sample: now and then one comes or goes."""
    here = {1, 2}
    for _ in range(count):
        if rng.random() < 0.15:
            here = here ^ {rng.randint(1, 5)}
        yield tuple(sorted(here))


def sampled(
    layout: LinkedProgram, states: States, now: int, objects: dict[int, dict[str, Interval]]
) -> tuple[States, Any]:
    """One sample of the signals of some objects: the states after it, and all intervals."""
    arena = np.full(layout.size, np.nan)
    for step, node in layout.program.lookups():
        values = [objects[i][node.name] for i in sorted(objects)]
        at = layout.places[step]
        arena[at : at + 2 * layout.n] = np.array(values, dtype=float).reshape(layout.n, 2).T.ravel()
    return layout.step(states, now, np.zeros(0, np.int8), arena), arena


def by_arrays(
    formula: Formula, times: list[float], seen: list[dict[int, dict[str, Interval]]]
) -> list[dict[int, Interval]]:
    """The formula of `a` for all objects at once, as rules are judged."""
    compiler = Compiler()
    place = compiler.formula(formula, (("a", False),))
    prepared = CompiledRules((), compiler, ())
    ids = tuple(sorted(seen[0]))
    states = prepared.initial_states(len(ids))
    told: list[dict[int, Interval]] = []
    for time, objects in zip(times, seen, strict=True):
        now = tuple(sorted(objects))
        if now != ids:
            states = reindexed_states(prepared, states, ticks(time), ids, now)
        ids, layout = now, prepared.layout(len(now))
        states, arena = sampled(layout, states, ticks(time), objects)
        told.append({i: layout.interval(place.step, (k,), arena) for k, i in enumerate(ids)})
    return told


@pytest.mark.parametrize("block", range(4))
def test_of_all_objects_at_once_it_is_the_same_and_who_is_new_has_no_past(block: int) -> None:
    for seed in range(60 * block, 60 * block + 60):
        rng = Random(f"arrays {seed}")
        formula = random_formula(rng, rng.randint(1, 3), ("a",))
        times = random_times(rng, rng.randint(4, 20))
        seen = [
            {i: {name: random_value(rng) for name in SIGNALS} for i in here}
            for here in cast(rng, len(times))
        ]
        told = by_arrays(formula, times, seen)
        for begin, end, object_id in stays(seen):
            stay = [(ticks(times[k]), seen[k][object_id]) for k in range(begin, end)]
            truth = robustness(formula, stay)
            mine = [told[k][object_id] for k in range(begin, end)]
            assert all(map(alike, mine, truth)), f"{seed}: {formula}, object {object_id}"


def stays(seen: list[dict[int, dict[str, Interval]]]) -> Iterator[tuple[int, int, int]]:
    """(begin, end, object) of every stretch of samples in which an object is there."""
    for object_id in {i for objects in seen for i in objects}:
        begin = None
        for k in range(len(seen) + 1):
            here = k < len(seen) and object_id in seen[k]
            if here and begin is None:
                begin = k
            if not here and begin is not None:
                yield begin, k, object_id
                begin = None


def test_facts_keep_one_moment_and_are_judged_as_the_oracle_judges_numbers_without_end() -> None:
    """`for` and `within` of what is no matter of degree have an operator of their own."""
    for seed in range(150):
        rng = Random(f"facts {seed}")
        window = rng.choice((40, 80, 200, 500, 1000))
        text = rng.choice(("x() > 0 for {} ms", "x() > 0 within {} ms", "not (x() > 0 for {} ms)"))
        formula = parse_formula(text.format(window), signals("x"))
        times = random_times(rng, 20)
        codes = [rng.choice((-1, 0, 1)) for _ in times]
        bounds = {-1: (-inf, -inf), 0: (-inf, inf), 1: (inf, inf)}
        truth = robustness(
            formula, [(ticks(t), {"x": bounds[c]}) for t, c in zip(times, codes, strict=True)]
        )
        compiler = Compiler()
        place = compiler.formula(fact_for(formula), (("a", False),))
        layout = CompiledRules((), compiler, ()).layout(1)
        states = layout.fresh
        for time, code, expected in zip(times, codes, truth, strict=True):
            arena = np.full(layout.size, np.nan)
            states = layout.step(states, ticks(time), np.array([code], np.int8), arena)
            found = layout.interval(place.step, (0,), arena)
            assert found == expected, f"{seed}: {formula}"


def fact_for(formula: Formula) -> Formula:
    """The same formula of the fact `seen(a)` instead of the comparison."""
    from dataclasses import replace

    from visup.rules.formula.nodes import Comparison, Not, PastOperator

    if isinstance(formula, Comparison):
        return Predicate("seen", ("a",))
    assert isinstance(formula, Not | PastOperator)
    return replace(formula, part=fact_for(formula.part))


def test_an_older_state_goes_on_rightly_after_newer_ones_were_made_from_it() -> None:
    for seed in range(60):
        rng = Random(f"branch {seed}")
        formula = random_formula(rng, 3)
        times = random_times(rng, 24)
        common, rest = history(rng, times[:12]), [history(rng, times[12:]) for _ in range(3)]
        monitor = Monitor(formula)
        for t, values in common:
            monitor.step(t, values)
        fork = monitor.state
        for branch in (*rest, rest[0]):
            monitor.state = fork
            told = [monitor.step(t, values) for t, values in branch]
            truth = robustness(formula, [(ticks(t), v) for t, v in (*common, *branch)])
            assert all(map(alike, told, truth[12:])), f"{seed}: {formula}"


def size_of(state: Any, counted: set[int]) -> int:
    """How many cells a state holds that were not counted before."""
    todo, count = [state], 0
    while todo:
        one = todo.pop()
        if isinstance(one, tuple) and id(one) not in counted:
            counted.add(id(one))
            count += 1
            todo += one
    return count


def test_states_of_many_samples_share_all_but_a_few_cells() -> None:
    formula = parse_formula("(x() > 1 since[20 s] x() > 2) for 10 s", signals("x"))
    monitor, rng, states = Monitor(formula), Random(5), []
    for k in range(3000):
        monitor.step(k * 0.04, {"x": rng.random() * 3})
        states.append(monitor.state)
    counted: set[int] = set()
    assert sum(size_of(s, counted) for s in states) < 60 * len(states)


def test_what_a_window_holds_is_bounded_by_its_length() -> None:
    monitor = Monitor(parse_formula("x() > 1 for 1 s", signals("x")))
    sizes = []
    for k in range(1500):
        monitor.step(k * 0.01, {"x": float(k % 7)})
        sizes.append(size_of(monitor.state, set()))
    # A cell and a value for each sample, and one value more for those that were folded anew.
    assert max(sizes) <= 3 * max_samples(ticks(1.0)) + 5


@pytest.mark.parametrize(
    ("text", "samples", "expected"),
    [
        # Nothing is known of the time before the first sample.
        ("x() > 1 for 0.1 s", {0.0: 3, 0.1: 2}, [(-inf, 2), (1, 1)]),
        ("x() > 1 within 0.1 s", {0.0: 0, 0.1: 0.5}, [(-1, inf), (-0.5, -0.5)]),
        # A window holds the sample that stands where it begins.
        ("x() > 1 for 0.1 s", {0.0: 0, 0.05: 3, 0.12: 4}, [(-inf, -1), (-inf, -1), (-1, -1)]),
        # A sample speaks for half a second; then nothing is known.
        ("x() > 1 for 1 s", {0.0: 3, 0.5: 3, 1.0: 3}, [(-inf, 2), (-inf, 2), (2, 2)]),
        ("x() > 1 for 1 s", {0.0: 3, 0.5: 3, 1.1: 3}, [(-inf, 2), (-inf, 2), (-inf, 2)]),
        # The last value is held only when that is asked for.
        ("last(x() > 1, 0.2 s)", {0.0: 3, 0.1: None, 0.3: None}, [(2, 2), (2, 2), (-inf, inf)]),
        # Of equal numbers >= holds and > does not.
        ("x() >= 1", {0.0: 1}, [(1e-300, 1e-300)]),
        ("x() > 1", {0.0: 1}, [(-1e-300, -1e-300)]),
        # Once entered, the second threshold counts.
        ("x() > 5 leave 3", {0: 4, 1: 6, 2: 4, 3: 2, 4: 4},
         [(-1, -1), (1, 1), (1, 1), (-1, -1), (-1, -1)]),
        ("x() > 1 in 2 of 3 samples", {0: 2, 0.1: 0, 0.2: 2}, [(-1, 1), (-1, 0), (0, 0)]),
        ("x() > 1 in 50 % of 0.2 s", {0: 2, 0.1: 0, 0.2: 0, 0.3: 0},
         [(-0.5, 0.5), (0, 0.5), (0, 0), (-0.5, -0.5)]),
        ("eventually[0.1 s] x() > 1", {0: 3, 0.1: 0, 0.2: 0.5}, [(2, inf), (2, 2), (-0.5, -0.5)]),
        ("rate(x(), 0.2 s) > 1 /s", {0: 1, 0.1: 3, 0.2: 2}, [(-inf, inf), (-inf, inf), (4, 4)]),
        ("once x() > 1 and not always x() > 1", {0: 3, 0.1: 0}, [(-2, -2), (1, 1)]),
        ("x() < 2 since x() > 3", {0: 4, 0.1: 1, 0.2: 5, 0.3: 2.5}, [(1, 1), (1, 1), (2, 2), (-0.5, -0.5)]),
    ],
)  # fmt: skip
def test_examples(text: str, samples: dict[float, float | None], expected: list[Interval]) -> None:
    monitor = Monitor(parse_formula(text, signals("x")))
    told = [monitor.step(t, {"x": v}) for t, v in samples.items()]
    assert all(map(alike, told, expected)), told


def test_a_verdict_of_the_future_comes_late_and_what_stands_beside_it_waits() -> None:
    both = "x() > 1 and eventually[0.2 s] x() > 5"
    monitor = Monitor(parse_formula(both, signals("x")))
    assert monitor.delay == pytest.approx(0.2)
    told = [monitor.step(k / 10, {"x": x}) for k, x in enumerate((2.0, 0.0, 9.0, 0.0, 0.0))]
    assert [verdict(t).value for t in told] == ["unknown", "unknown", "true", "false", "true"]


def test_what_looks_back_without_end_begins_with_the_first_sample_also_of_what_is_told_late() -> (
    None
):
    falling = [(k / 10, {"x": 1.0 if k < 5 else -1.0}) for k in range(40)]
    once = Monitor(parse_formula("once (eventually[1 s .. 2 s] x() > 0)", signals("x")))
    told = [verdict(once.step(t, v)).value for t, v in falling]
    assert told == ["unknown"] * 20 + ["false"] * 20
    always = Monitor(parse_formula("always (henceforth[1 s] x() > 0)", signals("x")))
    told = [verdict(always.step(k / 10, {"x": 1.0})).value for k in range(20)]
    assert told == ["unknown"] * 10 + ["true"] * 10


@pytest.mark.parametrize(
    "nan", [float("nan"), np.float64("nan"), np.float32("nan"), (np.nan, np.nan), None]
)
def test_nan_of_any_kind_is_unknown_on_either_side(nan: Any) -> None:
    for text in ("x() > 0 or y() > 0", "y() > 0 or x() > 0"):
        monitor = Monitor(parse_formula(text, signals("x", "y")))
        assert monitor.step(0.0, {"x": nan, "y": np.float32(-1)}) == (-1, inf)
        assert monitor.step(0.1, {"x": nan, "y": 2}) == (2, inf)


@pytest.mark.parametrize("value", [(2, 1), (inf, -inf)])
def test_a_reversed_interval_is_refused(value: Interval) -> None:
    monitor = Monitor(parse_formula("x() > 0", signals("x")))
    with pytest.raises(SettingsError, match="interval"):
        monitor.step(0.0, {"x": value})


@pytest.mark.parametrize(
    "value", ["open", np.array([1.0, 2.0]), (1.0, 2.0, 3.0), ("a", "b"), {}, 10**400]
)
def test_what_is_no_number_is_refused_in_words(value: Any) -> None:
    for made in (Monitor, DenseTimeMonitor):
        with pytest.raises(SettingsError, match="a signal is"):
            made(parse_formula("x() > 0", signals("x"))).step(0.0, {"x": value})


WRONG_TIMES: list[tuple[Any, ...]] = [(0.0, 0.0), (1.0, 0.5), (0.0, inf), (float("nan"),), (-inf,)]


@pytest.mark.parametrize("times", [*WRONG_TIMES, (None,), ("3",), (0.0, np.array([1.0, 2.0]))])
def test_times_that_do_not_increase_are_refused_and_leave_the_monitor_as_it_was(
    times: tuple[Any, ...],
) -> None:
    monitor = Monitor(parse_formula("x() > 0 for 1 s", signals("x")))
    for time in times[:-1]:
        monitor.step(time, {"x": 1})
    before = monitor.state
    with pytest.raises(SettingsError, match="sample"):
        monitor.step(times[-1], {"x": 1})
    assert monitor.state is before


def test_a_quotient_is_rounded_once() -> None:
    """The last digit decides a tie: 2.5 / (2.5 / 0.75) is 0.75 again."""
    monitor = Monitor(parse_formula("x() / (x() / y()) == 0.75", signals("x", "y")))
    assert verdict(monitor.step(0.0, {"x": 2.5, "y": 0.75})) is Truth.TRUE
    told = monitor.step(0.1, {"x": (2.0, 3.0), "y": (-1.0, 1.0)})
    assert verdict(told) is Truth.UNKNOWN
