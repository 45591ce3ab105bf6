"""What is decided about the future before it has come: never contradicted, never later than needed."""

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.early_verdicts import both_told
from tests.oracles.rule_formulas import random_formula
from tests.rules.runs import Thought, think
from tests.rules.safety.test_reasoner import closing
from visup.agent import Truth
from visup.rules.formula.nodes import Formula
from visup.rules.language.parser import parse_formula, parse_rules
from visup.rules.monitoring.compiler import Compiler
from visup.rules.monitoring.early import EarlyCompiler
from visup.rules.monitoring.further_operators import FollowedWindow
from visup.rules.monitoring.intervals import FALSE, TRUE, AtEnd, Scalars, verdict
from visup.rules.monitoring.monitor import Monitor
from visup.rules.predicates.vocabulary import signals
from visup.rules.reasoners import default_reasoners
from visup.rules.safety.pending_verdicts import open_rules
from visup.rules.safety.queries import explain


def formula(text: str) -> Formula:
    return parse_formula(text, signals("x", "y"))


@settings(max_examples=150)
@given(st.integers(0, 10**9), st.integers(1, 4))
def test_what_is_told_in_the_end_lies_within_what_was_foreseen(seed: int, depth: int) -> None:
    rng = Random(seed)
    for early, late in both_told(random_formula(rng, depth), rng, 450_000):
        assert early[0] <= late[0]
        assert late[1] <= early[1]


@settings(max_examples=100)
@given(st.integers(0, 10**9), st.integers(1, 4))
def test_where_samples_are_missing_it_is_never_contradicted(seed: int, depth: int) -> None:
    rng = Random(seed)
    opposite = {(Truth.TRUE, Truth.FALSE), (Truth.FALSE, Truth.TRUE)}
    for early, late in both_told(random_formula(rng, depth), rng, None):
        assert (verdict(early), verdict(late)) not in opposite


@pytest.mark.parametrize(
    ("text", "xs", "wanted"),
    [
        ("eventually[60 s] x() > 0", [-1, -1, 1, -1], "??T?"),
        ("henceforth[60 s] x() > 0", [1, 1, -1, 1], "??F?"),
        ("not eventually[60 s] x() > 0", [-1, 1], "?F"),
        ("x() > 1 until[60 s] x() > 2", [2, 3, 1], "?TF"),
        ("x() < 0 or eventually[60 s] x() > 2", [-1, 3, 1], "TT?"),
        ("x() < 0 and henceforth[60 s] x() < 2", [-1, 3, 1], "?FF"),
        ("eventually[0.1 s .. 60 s] x() > 0", [-1, 1, -1], "?T?"),
        ("henceforth[60 s] eventually[60 s] x() > 0", [-1, 1], "??"),
        ("once (eventually[60 s] x() > 0)", [-1, 1, -1], "?TT"),
        ("(henceforth[60 s] x() > 0) for 0.1 s", [1, -1, 1, 1], "?FF?"),
        ("eventually[60 s] x() > 0 and x() > 5 for 0.1 s", [1, 6, 7, -1], "FFTF"),
    ],
)
def test_it_is_told_as_soon_as_it_is_decided(text: str, xs: list[float], wanted: str) -> None:
    monitor, told = Monitor(formula(text), early=True), ""
    letters = {Truth.TRUE: "T", Truth.FALSE: "F", Truth.UNKNOWN: "?"}
    for k, x in enumerate(xs):
        monitor.step(k / 10, {"x": float(x), "y": 0.0})
        told += letters[verdict(monitor.foreseen())]
    assert told == wanted


def test_its_memory_does_not_grow_with_the_window() -> None:
    def kept(text: str) -> int:
        compiler = Compiler()
        found = EarlyCompiler(compiler).formula(formula(text))
        before = Compiler()
        before.formula(formula(text))
        assert found.wait
        return len(compiler.program.steps) - len(before.program.steps)

    assert kept("eventually[1 s] x() > 0") == kept("eventually[60 s] x() > 0") == 2


@pytest.mark.parametrize(("view", "wanted"), [("unknown", "T?"), ("weak", "TT"), ("strong", "TF")])
def test_what_is_open_at_the_end_is_told_as_one_chooses(view: AtEnd, wanted: str) -> None:
    monitor = Monitor(formula("eventually[1 s] x() > 0"))
    monitor.step(0.0, {"x": 1.0})
    monitor.step(0.1, {"x": -1.0})
    before = monitor.state
    told = monitor.finish(view)
    assert [time for time, _ in told] == [0.0, 0.1]
    letters = {Truth.TRUE: "T", Truth.FALSE: "F", Truth.UNKNOWN: "?"}
    assert "".join(letters[verdict(v)] for _, v in told) == wanted
    assert monitor.state is before


def thoughts(text: str, early: bool) -> list[Thought]:
    """What is concluded while two objects approach each other."""
    found = default_reasoners(rules=parse_rules(text), early=early)
    return list(think((*found.update, *found.cogitate), closing(8.0, 40.0)))


def alerts(text: str, early: bool) -> list[float]:
    """When an alert of a rule stands."""
    return [t.mind.time for t in thoughts(text, early) if t.conditions]


SOON = """
rule near(a, b): info
    when gap(a, b) < 62 px and eventually[2 s] gap(a, b) < 60 px
    say "{a} {b}"
"""
SUSPENDED = SOON.replace("say", "unless henceforth[1 s] gap(a, b) < 10 px say")


MOMENT = """
rule near(a, b): info
    when falling(gap(a, b) > 100 px) and eventually[3 s] gap(a, b) < 60 px
    say "{a} {b}"
"""


@pytest.mark.parametrize("text", [SOON, SUSPENDED, MOMENT, MOMENT.replace("[3", "[0.5 s .. 3")])
def test_an_alert_is_raised_sooner_and_stands_until_it_is_told_in_the_end(text: str) -> None:
    early, late = alerts(text, early=True), alerts(text, early=False)
    assert late
    assert set(late) <= set(early)
    assert early[0] <= late[0] - 0.9
    # One alert, and not two.
    assert max(b - a for a, b in pairwise(early)) < 0.5


def test_it_is_said_that_a_rule_is_true_before_its_verdict_has_come() -> None:
    mind = next(t.mind for t in thoughts(SOON, early=True) if t.conditions)
    told = str(explain(mind, "near", 1, 2))
    assert told.splitlines()[0].startswith("near(")
    assert " is true" in told.splitlines()[0]
    assert "what is decided by now is true" in told


@pytest.mark.parametrize(
    ("when", "weak", "strong"),
    [
        ("gap(a, b) < 400 px and eventually[60 s] gap(a, b) < 200 px", True, True),
        ("gap(a, b) < 400 px and eventually[60 s] gap(a, b) > 900 px", True, False),
        ("not seen(a) and eventually[60 s] gap(a, b) < 1 px", False, False),
        ("henceforth[60 s] gap(a, b) < 400 px", True, False),
        ("eventually[60 s] gap(a, b) > 400 px", True, False),
        ("gap(a, b) < 200 px", False, False),
    ],
)
def test_rules_that_are_due_at_the_end_are_told_as_one_chooses(
    when: str, weak: bool, strong: bool
) -> None:
    text = f'rule near(a, b): info when {when} say "{{a}} {{is}} near {{b}}."'
    mind = thoughts(text, early=False)[-1].mind
    assert open_rules(mind, "unknown") == ()
    told = open_rules(mind, "weak"), open_rules(mind, "strong")
    assert tuple(map(bool, told)) == (weak, strong)
    assert all(o.decided == strong for o in told[0])
    assert all(str(o).startswith("At the end rule 'near' is ") for o in told[0])


@settings(max_examples=60)
@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=30), st.integers(1, 8))
def test_what_was_followed_is_what_one_finds_by_looking(
    seen: list[tuple[bool, bool]], window: int
) -> None:
    step, state = FollowedWindow(window * 100_000).on(Scalars()), None
    for k, _ in enumerate(seen):
        first, second = (TRUE if held else FALSE for held in seen[k])
        state, told = step(state, k * 100_000, first, second)
        near = range(max(0, k - window), k + 1)
        wanted = any(seen[i][0] and seen[j][1] for i in near for j in near if i <= j)
        assert (verdict(told) is Truth.TRUE) == wanted
