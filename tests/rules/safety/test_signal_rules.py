"""Rules about signals alone, exact between samples."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest
from typer.testing import CliRunner

from visup.agent import Truth
from visup.agent.model.errors import RuleError
from visup.cli import app
from visup.rules.dense_time import Ends
from visup.rules.formula.nodes import Rule
from visup.rules.language.parser import parse_rules
from visup.rules.safety.signal_rules import RuleSpan, judge_rule

CUT = Ends("cut", "cut")
Row = tuple[float, dict[str, Any]]


def rule(when: str, head: str = "hot()") -> Rule:
    (found,) = parse_rules(f'rule {head}: warning\n    when {when}\n    say "It is hot."\n')
    return found


def spans(when: str, *rows: Row, reading: Any = "held") -> list[Any]:
    told = judge_rule(rule(when), rows, reading, CUT, 10.0)
    return [(s.begin_s, s.end_s) for s in told if s.truth is Truth.TRUE]


def test_a_value_stands_until_the_next_sample_and_windows_end_between() -> None:
    rows = [(0.0, {"heat": 1}), (2.0, {"heat": 9}), (3.0, {"heat": 1}), (9.0, {"heat": 1})]
    assert spans("signal(heat) > 5", *rows) == [(2.0, 3.0)]
    assert spans("signal(heat) > 5 within 1.5 s", *rows) == [(2.0, 4.5)]
    assert spans("signal(heat) > 5 for 0.4 s", *rows) == [(2.4, 3.0)]
    assert spans("(signal(heat) > 5 within 1.5 s) for 1 s", *rows) == [(3.0, 4.5)]


def test_numbers_may_lie_on_a_line_between_samples() -> None:
    rows = [(0.0, {"heat": 0}), (10.0, {"heat": 10})]
    assert spans("signal(heat) > 2.5", *rows, reading="linear") == [
        (pytest.approx(2.5), pytest.approx(10.0))
    ]
    with pytest.raises(RuleError, match="no line"):
        spans("signal_on(fan)", (0.0, {"fan": True}), reading="linear")


def test_words_and_truth_values_are_signals_too() -> None:
    rows: list[Row] = [
        (0.0, {"mode": "auto", "fan": True}),
        (4.0, {"mode": "hand"}),
        (6.0, {"fan": 0}),
    ]
    assert spans("signal_is(mode, auto) and signal_on(fan)", *rows) == [(0.0, 4.0)]
    assert spans("not signal_known(fan)", *rows) == [(4.0, 6.0)]
    assert spans("not signal_on(fan)", *rows) == [(6.0, 10.0)]


def test_what_is_not_known_neither_alerts_nor_suspends() -> None:
    suspended = parse_rules(
        'rule hot(): warning\n when signal(heat) > 5\n unless signal_on(fan)\n say "Hot."\n'
    )[0]
    rows: list[Row] = [(0.0, {"heat": 9}), (2.0, {"heat": 9, "fan": True}), (4.0, {"fan": False})]
    assert judge_rule(suspended, rows, "held", CUT, 6.0) == [
        RuleSpan("hot", 0.0, 2.0, Truth.TRUE),
        RuleSpan("hot", 4.0, 6.0, Truth.UNKNOWN),
    ]


@pytest.mark.parametrize("seed", range(20))
def test_held_rows_given_more_often_change_nothing(seed: int) -> None:
    """A law: a row that is repeated between two others says nothing new."""
    rng = Random(seed)
    times = sorted({0.0, *(rng.randint(1, 90) / 10 for _ in range(6))})
    rows = [(t, {"heat": rng.randint(0, 9)}) for t in times]
    middles = [((a[0] + b[0]) / 2, a[1]) for a, b in pairwise(rows)]
    for when in ("signal(heat) > 4 within 0.7 s", "(signal(heat) > 4 for 0.3 s) within 1.1 s"):
        assert spans(when, *rows) == spans(when, *sorted(rows + middles, key=lambda r: r[0]))


def test_a_rule_about_objects_is_refused_in_words() -> None:
    with pytest.raises(RuleError, match="not about signals"):
        judge_rule(rule("speed(a) > 3 px/s", "fast(a)"), [(0.0, {})])


def test_the_command_reports_spans(tmp_path: Path) -> None:
    (tmp_path / "hot.rules").write_text(str(rule("signal(heat) > 5 within 1.5 s")), "utf-8")
    (tmp_path / "heat.csv").write_text("time,heat\n0,1\n2,9\n3,1\n", "utf-8")
    given = ["rules", "judge", str(tmp_path / "hot.rules"), "--signal", str(tmp_path / "heat.csv")]
    told = CliRunner().invoke(app, [*given, "--ends", "cut", "--end", "9"])
    assert told.exit_code == 0, told.output
    assert told.output == "hot: true from 2 s to 4.5 s\n"
    lines = CliRunner().invoke(app, [*given, "--ends", "cut", "--end", "9", "--json"])
    assert '"truth": "true"' in lines.output
