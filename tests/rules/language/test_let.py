"""Values that are noted at one time and used at another: `let x be q at f: g`."""

import json
import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest

from tests.rules.runs import think
from tests.rules.scenes import box_region, seen
from visup.agent import Mind, Observation
from visup.agent.model.errors import ErrorGroup, RuleError
from visup.rules.dense_time import judge_recording
from visup.rules.formula.nodes import Formula
from visup.rules.language.keywords import FUNCTIONS, KEYWORDS
from visup.rules.language.parser import parse_formula, parse_rules
from visup.rules.language.rule_builder import fact, let, noted, px, quantity, rule, s
from visup.rules.monitoring.cost import cost_of
from visup.rules.monitoring.intervals import UNKNOWN
from visup.rules.monitoring.monitor import Monitor
from visup.rules.predicates.vocabulary import signals
from visup.rules.reasoners import default_reasoners
from visup.rules.safety.queries import explain

GOOD = [
    "let p be gap(a, b) at touching(a, b): gap(a, b) > p + 20 px",
    "let p be gap(a, b) / 1 s at touching(a, b) or seen(a): speed(a) > p",
    "let p be speed(a) at rising(seen(b)): (let q be speed(b) at falling(seen(a)): abs(p - q) > 3 px/s)",
    "let p be gap(a, b) at touching(a, b): (gap(a, b) > p for 2 s)",
    "let p be gap(a, b) at touching(a, b): eventually[2 s] gap(a, b) > p",
    "let p be gap(a, b) at once seen(a): rate(p, 2 s) > 3 px/s",
    "exists c: let p be gap(a, c) at touching(a, b): gap(a, c) > p",
]
BAD = {
    "let p be gap(a, b) at touching(a, b): speed(a) > p": "a speed is compared with a length",
    "let p be gap(a, b) + 2 s at touching(a, b): gap(a, b) > p": "is added to",
    "let p be gap(a, b) at touching(a, b): gap(a, b) > 3 px": "'p' of 'let' is not used",
    "let a be gap(a, b) at touching(a, b): gap(a, b) > a": "already the name of an object",
    "let p be gap(a, b) at touching(a, b): "
    "(let p be gap(a, b) at seen(a): gap(a, b) > p)": "already the name of a value",
    "let p be gap(a, b) at eventually[2 s] touching(a, b): gap(a, b) > p": "cannot be noted before",
    "(let p be gap(a, b) at seen(a): gap(a, b) > p) and gap(a, b) > p": "is a name, not a quantity",
    "let p be gap(a, b) at p > 3 px: gap(a, b) > p": "is a name, not a quantity",
    "gap(a, b) > p": "is a name, not a quantity",
    "objects > 3 and touching(a, b)": "written with parentheses",
    "gap < 3 px and touching(a, b)": "takes 2 argument(s), not 0",
}


def text_of(condition: str) -> str:
    return f'rule r(a, b): info\n    when {condition}\n    say "{{a}} {{b}}"\n'


def formula(text: str) -> Formula:
    return parse_formula(text, signals("x", "y"))


@pytest.mark.parametrize("condition", GOOD)
def test_it_prints_as_it_is_read(condition: str) -> None:
    (found,) = parse_rules(text_of(condition))
    assert parse_rules(str(found)) == (found,)


@pytest.mark.parametrize(("condition", "what"), BAD.items())
def test_what_has_no_sense_is_told(condition: str, what: str) -> None:
    with pytest.raises((RuleError, ErrorGroup), match=re.escape(what)):
        parse_rules(text_of(condition))


def test_python_builds_the_same() -> None:
    near = quantity.gap("a", "b")
    claim = let("p", near, fact.touching("a", "b"), near > noted("p") + px(20))
    assert parse_rules(text_of(GOOD[0])) == (rule("r", "a b", "info", claim, "{a} {b}"),)
    with pytest.raises(RuleError):
        rule("r", "a b", "info", claim & (near > noted("p")), "{a} {b}", hold=s(1))


def test_the_value_is_that_of_the_last_time_however_long_ago() -> None:
    monitor = Monitor(formula("let v be x() at rising(y() > 0): x() > v + 1"))
    told = [
        monitor.step(t, {"x": x, "y": y})
        for t, x, y in ((0, 5, -1), (0.1, 1, 1), (0.2, 3, 1), (90, 2.5, -1), (90.1, 9, 1))
    ]
    assert told == [UNKNOWN, (-1.0, -1.0), (1.0, 1.0), (0.5, 0.5), (-1.0, -1.0)]


def test_between_samples_it_is_the_same() -> None:
    text = "let v be x() at y() > 0: (x() > v for 0.2 s)"
    samples = [(k / 10, {"x": float(k * 7 % 5), "y": float(k % 4) - 2}) for k in range(30)]
    monitor = Monitor(formula(text))
    told = [monitor.step(t, values) for t, values in samples]
    pieces = judge_recording(formula(text), samples, "samples")
    for (time, _), value in zip(samples[:-1], told, strict=False):
        (there,) = (p.robustness for p in pieces if p.begin_s <= time < p.end_s)
        assert there == value


def test_its_memory_is_one_value() -> None:
    (found,) = parse_rules(text_of("let p be gap(a, b) at touching(a, b): gap(a, b) > p"))
    assert cost_of(found).kept == 1


PUT_BACK = """
rule put_elsewhere(a, b): info
    when let x be position_x(a) at touching(a, b) and position_x(a) < 200 px: position_x(a) > x + 100 px
    say "{a} has been taken away from where it was with {b}."
"""


def taken_away() -> Iterator[Observation]:
    """Two boxes touch; after 2 s the second one goes to the right and takes nothing along."""
    for i in range(150):
        away = max(0, i - 50) * 3
        yield seen(i, [box_region(1, (100, 200, 60, 60)), box_region(2, (160 + away, 200, 60, 60))])


def test_a_rule_remembers_a_place() -> None:
    reasoners = default_reasoners(rules=parse_rules(PUT_BACK))
    minds: list[tuple[Mind, bool]] = [
        (t.mind, bool(t.conditions))
        for t in think((*reasoners.update, *reasoners.cogitate), taken_away())
    ]
    first = next(i for i, (_, alert) in enumerate(minds) if alert)
    assert 80 < first < 95
    told = str(explain(minds[first][0], "put_elsewhere", 2, 1))
    assert re.search(r"^ +x = 1[89]\d px", told, re.M), told


def test_every_word_of_the_grammar_is_explained_and_coloured() -> None:
    grammar = files("visup.rules.language").joinpath("rules.lark").read_text(encoding="utf-8")
    reserved = re.search(r"^NAME: /\(\?!\(([a-z|]+)\)", grammar, re.M)
    assert reserved is not None
    assert set(reserved[1].split("|")) == set(KEYWORDS)
    colours = Path(__file__).parents[3] / "editors/vscode/syntaxes/rules.tmLanguage.json"
    patterns = " ".join(p.get("match", "") for p in json.loads(colours.read_text())["patterns"])
    assert not [w for w in KEYWORDS if not re.search(rf"\b{w}\b", patterns)]
    for form, _ in (*KEYWORDS.values(), *FUNCTIONS.values()):
        assert form
