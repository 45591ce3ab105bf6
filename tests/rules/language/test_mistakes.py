"""Deliberate mistakes: each is told with its place, what was expected, and a change that makes it legal."""

from functools import partial

import pytest

from visup.agent.model.errors import ErrorGroup, RuleError, SourceLocation, VisupError
from visup.rules.language import diagnostics, error_recovery
from visup.rules.language.fixes import TextFix, fix_of
from visup.rules.language.parser import parse_rules
from visup.rules.predicates.vocabulary import RULES as VOCABULARY

CONDITIONS = [
    "exists c: touching(a, c) and touching(b, c)",
    "moving(a and speed(a) > 200 px/s and seen(b)",
    "let x = speed(a) when touching(a, b): speed(a) > x",
    "not touching(a, b), seen(a)",
    "touching(a, b), not coupled(a, b)",
    "rising(gap(a, b) > 3 px) and",
    "sqrt(gap(a, b)) > 3 px",
    "gap(a, b) = 3 px",
    "gap(a, b) === 3 px",
    "touching(a, b) -> coupled(a, b)",
    "touching(a, b) => coupled(a, b)",
    "touching(a, b) && seen(a)",
    "touching(a, b) || seen(a)",
    "!touching(a, b)",
    "historically touching(a, b)",
    "touching(a, b) within 5",
    "touching(a, b) for 2",
    "touching(a, b) for 2 seconds",
    "touching(a, b) FOR 2 s",
    "gap(a, b) between 3 px and 5 px",
    "globally touching(a, b)",
    "F[5 s] touching(a, b)",
    "touching(a, b) until seen(a)",
    "exists touching(a, c) and seen(b)",
    "forall c touching(a, c) and seen(b)",
    "exist c: touching(a, c) and seen(b)",
    "gap(a, b) < 3",
    "gap(a, b) < 3 s",
    "gap(a, b) < 3 pixels",
    "gap(a b) < 3 px",
    "touching(a, b",
    "touching a b",
    "touchng(a, b)",
    "touching(a)",
    "touching(a, a) and seen(b)",
    "gap(a, b) > 3px and",
    "gap(a, b) 3 px",
    "3 px < gap(a, b) < 5 px",
    "touching(a, b) in 3 of 5",
    "touching(a, b) in 60% of 5",
    "touching(a, b) for 5 s ago",
    "previously touching(a, b)",
    "next touching(a, b)",
    "touching(a, b) unless seen(a) unless seen(b)",
    "hidden(a) and and seen(b)",
    "named(a) and seen(b)",
    "inside(a, bay, x) and seen(b)",
    "time_to_contact(a, b) < 5 sec",
    "abs(gap(a, b) < 3 px",
    "touching(a, b) for -2 s",
    "touching(a, b) before seen(a)",
    "let p = position_x(a) at touching(a, b): position_x(a) > p + 20 px",
    "let p be position_x(a) when touching(a, b): position_x(a) > p + 20 px",
    "let p be position_x(a) at touching(a, b), position_x(a) > p + 20 px",
    "remember p as gap(a, b) at touching(a, b): gap(a, b) > p",
    "let p be gap(a, b) at touching(a, b): gap(a, b) > q",
    "let p be gap(a, b): gap(a, b) > p",
    "let p be gap(a, b) at henceforth[2 s] touching(a, b): gap(a, b) > p",
    "let p gap(a, b) at touching(a, b): gap(a, b) > p",
    "let a be gap(a, b) at touching(a, b): gap(a, b) > a",
    "let p be gap(a, b) at touching(a, b): gap(a, b) > 3 px",
    "gap(a, b) in 3 px .. 5 px",
    "touching(a, b) within 5 frames",
    "there is c: touching(a, c) and seen(b)",
    "heading(a) == north and seen(b)",
    "touching(a, b) == false",
    "north east_of(a, b)",
    "3 of 5 samples touching(a, b)",
    "any 2 of (seen(a), seen(b), touching(a, b))",
    "speed(a) > 3px / s and seen(b)",
    "depth(a) < 3 meters and seen(b)",
    "gap(a, b) < 3 mm",
]
RULES = [
    'rule r(a, b) info\n when touching(a, b)\n say "x"',
    'rule r(a, b): error\n when touching(a, b)\n say "{a}{b}"',
    'rule r(a, b): info\n if touching(a, b)\n say "{a}{b}"',
    "rule r(a, b): info\n when touching(a, b)\n say '{a}'",
    'rule r(a, b): info\n when touching(a, b)\n hold 3\n say "{a}"',
    'rule (a, b): info\n when touching(a, b)\n say "{a}"',
    'Rule r(a, b): info\n when touching(a, b)\n say "{a}"',
    "rule r(a, b): info\n when touching(a, b)",
    'rule r(a, b): info\n say "{a}"\n when touching(a, b)',
    'rule r(a, b): info\n when touching(a, b)\n say "{a}"\n hold 3 s',
    '// comment\nrule r(a, b): info\n when touching(a, b)\n say "{a}"',
    'rule r a b: info\n when touching(a, b)\n say "{a}"',
    'rule r(a, b): INFO\n when touching(a, b)\n say "{a}"',
    'rule r(a, b): info\n when touching(a, b);\n say "{a}"',
    'rule r-1(a, b): info\n when touching(a, b)\n say "{a}"',
    'rule sink_failed(a, b): info\n when touching(a, b)\n say "{a}"',
]


def errors_of(text: str) -> list[VisupError]:
    try:
        parse_rules(text, "my.rules")
    except ErrorGroup as group:
        return list(group.errors)
    except RuleError as error:
        return [error]
    return []


def rule(condition: str) -> str:
    return f'rule r(a, b): info\n    when {condition}\n    say "{{a}} {{b}}"\n'


@pytest.mark.parametrize("text", [*map(rule, CONDITIONS), *RULES])
def test_taking_up_the_hints_makes_a_mistaken_rule_legal(text: str) -> None:
    errors = errors_of(text)
    assert errors
    for error in errors:
        assert isinstance(error.where, SourceLocation)
        assert "^" in str(error)
    for _ in range(5):
        if not errors:
            break
        fixes = (
            fix_of(text, e.where, e.hint) for e in errors if isinstance(e.where, SourceLocation)
        )
        fix = next((f for f in fixes if f is not None), None)
        assert fix is not None, [str(e) for e in errors]
        text = fix.applied(text)
        errors = errors_of(text)
    assert errors == [], text


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("touching(a, b) == false", "not touching(a, b)"),
        ("touching(a, b) != false", "touching(a, b)"),
        ("touching(a, b) is false", "not touching(a, b)"),
        ("north east_of(a, b)", "north_east_of(a, b)"),
        (
            "let p gap(a, b) at touching(a, b): gap(a, b) > p",
            "let p be gap(a, b) at touching(a, b): gap(a, b) > p",
        ),
        ("touching(a, b) within 5 frames", "touching(a, b) in 1 of 5 samples"),
        ("touching(a, b) never", "not touching(a, b)"),
        ("touching(a, b) more than 2 s", "touching(a, b) for 2 s"),
        ("touching(a, b) in 3/5 samples", "touching(a, b) in 3 of 5 samples"),
        ("henceforth touching(a, b) [5 s]", "henceforth[5 s] touching(a, b)"),
        ("time_to_contact(a, b) < 3", "time_to_contact(a, b) < 3 s"),
        ("gap(a, b) between 3 and 5 px", "gap(a, b) >= 3 px and gap(a, b) <= 5 px"),
        ("not gap(a, b) between 3 px and 5 px", "not (gap(a, b) >= 3 px and gap(a, b) <= 5 px)"),
        (
            "gap(a, b) between 3 px and 5 px for 2 s or seen(a)",
            "(gap(a, b) >= 3 px and gap(a, b) <= 5 px) for 2 s or seen(a)",
        ),
        (
            "seen(a) and gap(a, b) in 3 px .. 5 px within 2 s",
            "seen(a) and (gap(a, b) >= 3 px and gap(a, b) <= 5 px) within 2 s",
        ),
        ("3 px < gap(a, b) < 5 px for 2 s", "(3 px < gap(a, b) and gap(a, b) < 5 px) for 2 s"),
        ("clearly_moving(a) and seen(b)", "moving_clearly(a) and seen(b)"),
        ("depth_difference(a, b) < 15", "depth_difference(a, b) < 15 %"),
        ("overlap(a, b) > 50 and seen(a)", "overlap(a, b) > 50 % and seen(a)"),
        ("objects() > 3 % and seen(a)", "objects() > 3 and seen(a)"),
        ("signal(battery) > 90 %", "signal(battery) > 90"),
        ("signal(mode) == auto and seen(a)", "signal_is(mode, auto) and seen(a)"),
        ("a == arm and seen(b)", "named(a, arm) and seen(b)"),
        ("is_person(a) and seen(b)", "named(a, person) and seen(b)"),
        (
            "near_moving_actr(a) and seen(b)",
            "near_moving_actor(a) and seen(b)",
        ),  # not a synonym of near
        ("outside(a, bay) and seen(b)", "not reaching(a, bay) and seen(b)"),
        ("expected(touching(a, b))", "expected(touching, a, b)"),
        ("nobody touches a and seen(b)", "not (exists other: touching(other, a)) and seen(b)"),
        ("temperature > 60 and seen(a)", "signal(temperature) > 60 and seen(a)"),
        ("touching(a, b) in 3 of the last 5 frames", "touching(a, b) in 3 of 5 samples"),
        ("touching(a, b) for half a second", "touching(a, b) for 0.5 s"),
        ("is_known(battery) and seen(a)", "signal_known(battery) and seen(a)"),
        ("is_known(a) and seen(b)", "identified(a) and seen(b)"),
        ("touching(a, b) and press_running", "touching(a, b) and signal_on(press_running)"),
        (
            "touching(a, b) and signal_on(press running)",
            "touching(a, b) and signal_on(press_running)",
        ),
        ("touching(a, b) and objects() > four", "touching(a, b) and objects() > 4"),
    ],
)
def test_hints_restore_the_intended_text(written: str, meant: str) -> None:
    text = rule(written)
    (error,) = errors_of(text)
    assert isinstance(error.where, SourceLocation)
    fix = fix_of(text, error.where, error.hint)
    assert fix is not None
    assert fix.applied(text) == rule(meant)


@pytest.mark.parametrize(
    "share", ["depth_difference(a, b) < 0.15", "overlap(a, b) > 1", "signal(battery) > 90"]
)
def test_a_share_of_at_most_one_and_a_plain_number_need_no_unit(share: str) -> None:
    assert errors_of(rule(f"{share} and touching(a, b)")) == []


def test_a_slip_hides_nothing_of_what_else_is_wrong_with_the_rule() -> None:
    found = errors_of(rule("touchng(a, b), gap(a, b) < 3 && sen(a)"))
    whats = [e.what for e in found]
    assert len(found) == 5
    assert "there is no relation or fact 'touchng'" in whats
    assert "there is no relation or fact 'sen'" in whats
    assert "a length is compared with a number" in whats
    columns = [e.where.column for e in found if isinstance(e.where, SourceLocation)]
    assert columns == sorted(columns)
    assert {10, 23, 25, 39, 42} == set(columns)


def test_what_is_no_rule_at_all_is_told_in_time() -> None:
    noise = "rule " + "( ) when or and [ for 2 " * 300
    assert errors_of(noise)


def test_what_more_slips_cost_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    looked = []
    monkeypatch.setattr(error_recovery, "find_repair", lambda *_: looked.append("repair"))
    monkeypatch.setattr(error_recovery, "fix_of", lambda *_: looked.append("hint"))
    slip = 'rule r(a, b) info\n when touching(a, b) and and nearr(b)\n say "x"\n'
    spent = error_recovery.RepairBudget(left=-1)
    found = error_recovery.read_repaired(slip, "start", "r.rules", VOCABULARY, spent)
    told = found.diagnostics(slip)
    weigh = partial(error_recovery.weight, file="", budget=spent)
    assert told == error_recovery.with_tried_edits(slip, told, weigh)
    assert not looked


def test_once_nothing_may_be_tried_any_more_no_further_hint_is_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Hundreds of slips on a long line took minutes: each looked for edits that were then not tried."""
    looked: list[str | None] = []

    def counted(text: str, where: SourceLocation, hint: str | None) -> TextFix | None:
        looked.append(hint)
        return fix_of(text, where, hint)

    monkeypatch.setattr(error_recovery, "fix_of", counted)
    slips = " and ".join(f"standalon{n}(b)" for n in range(60))
    rule = f'rule r(a, b): info\n    when {slips}\n    say "x"\n'
    told = error_recovery.read_repaired(
        rule, "start", "r.rules", VOCABULARY, error_recovery.RepairBudget()
    ).diagnostics(rule)
    assert len(told) == 60
    left = error_recovery.RepairBudget(left=4 * len(rule))
    assert (
        len(
            error_recovery.with_tried_edits(
                rule, told, partial(error_recovery.weight, file="", budget=left)
            )
        )
        == 60
    )
    assert len(looked) <= 10


def test_names_that_are_unknown_are_compared_once_however_often_they_are_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each edit that is tried meets all faults of its file anew: a damaged file of 12 kB so took 12 s."""
    compared: list[tuple[str, str]] = []

    def counted(word: str, *given: object, **named: object) -> list[str]:
        compared.append((word, str(given)))  # with the relations, or with the quantities
        return []

    monkeypatch.setattr(diagnostics, "get_close_matches", counted)
    diagnostics._nearest_of.cache_clear()
    rule = 'rule r{0}(a, b): warning\n  when gop(a, b) < 1 px and qqqq{0}(a) > 2 px/s\n  say "x"\n'
    with pytest.raises(VisupError):
        parse_rules("".join(rule.format(n) for n in range(8)))
    diagnostics._nearest_of.cache_clear()
    assert compared
    assert len(compared) == len(set(compared))
