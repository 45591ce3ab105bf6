"""`touching(a, b) every 2 s to 4 s`: what happens again and again goes on while it keeps time."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, play, task_of
from visup.agent import Status, Truth, Verdict
from visup.rules.formula.truth import truth_if
from visup.tasks import parse_task
from visup.tasks.actions.rhythm import Beats, heard
from visup.tasks.supervision.supervise import finish, task_reasoner

WIPER, GLASS, CUP = 1, 2, 3
NAMES = {WIPER: {"wiper": 0.9}, GLASS: {"glass": 0.9}, CUP: {"cup": 0.9}}
WIPE = "<wipe> ::= touching(wiper, glass) every 2 s to 4 s for 12 s"
IN_TIME = (1.0, 4.0, 7.0, 10.0, 13.0, 16.0)
FPS = 5.0


def keeps_time(onsets: Sequence[float], now: float, shortest: float, longest: float) -> bool:
    """The definition, over the whole past: the last beat in time is no longer ago than the longest period."""
    in_time = [
        onset
        for i, onset in enumerate(onsets)
        if i == 0 or shortest <= onset - onsets[i - 1] <= longest
    ]
    return bool(in_time) and now - in_time[-1] <= longest


gaps = st.lists(st.integers(1, 60).map(lambda n: n / 10), max_size=16)


@given(gaps, st.integers(0, 30), st.integers(1, 40))
def test_rhythm_is_tracked_as_defined(steps: list[float], least: int, more: int) -> None:
    period = (least / 10 + 0.013, (least + more) / 10 + 0.017)
    turns = [sum(steps[: i + 1]) for i in range(len(steps))]  # so, not so, so, ...
    beats: Beats | None = None
    before = -0.1
    for k in range(round(10 * sum(steps)) + 30):
        now = k / 10
        past = [t for t in turns if t <= now + 1e-9]
        so = len(past) % 2 == 1
        beats = heard(beats, truth_if(so), past[-1] if past else 0.0, (before, now), period)
        before = now
        assert beats.keeps == keeps_time(past[::2], now, *period)


def test_unobserved_time_does_not_make_a_period_too_long() -> None:
    beats = heard(None, Truth.TRUE, 0.0, (0.0, 0.0), (2.0, 4.0))
    for k in range(1, 60):
        truth = Truth.UNKNOWN if 10 <= k < 50 else Truth.FALSE
        beats = heard(beats, truth, 0.0, ((k - 1) / 5, k / 5), (2.0, 4.0))
        assert beats.keeps
    for k in range(60, 64):
        beats = heard(beats, Truth.FALSE, 0.0, ((k - 1) / 5, k / 5), (2.0, 4.0))
    assert beats.late


def test_gaps_between_updates_do_not_count() -> None:
    beats = heard(None, Truth.TRUE, 0.0, (0.0, 0.0), (2.0, 4.0))
    beats = heard(beats, Truth.FALSE, 1.0, (0.0, 1.0), (2.0, 4.0))
    assert heard(beats, Truth.FALSE, 1.0, (59.8, 60.0), (2.0, 4.0)).keeps
    assert not heard(beats, Truth.FALSE, 1.0, (1.0, 60.0), (2.0, 4.0)).keeps


def wiped(
    onsets: Sequence[float], until: float, text: str = WIPE, more: Sequence[RelationSpan] = ()
) -> ScriptedRun:
    spans = [RelationSpan("touching", onset, onset + 0.6, (WIPER, GLASS)) for onset in onsets]
    objects = dict.fromkeys(NAMES, (0.0, 1e9))
    script = Script((*spans, *more), objects=objects, identities=NAMES)
    return play(task_reasoner([parse_task(text)]), script, until, FPS)


@pytest.mark.parametrize(
    ("onsets", "verdict"),
    [
        (IN_TIME, Verdict.SUCCEEDED),
        ((1.0, 4.0, 7.0), Verdict.FAILED),
        (tuple(range(1, 20)), Verdict.FAILED),  # too soon each time: never in time
        ((1.0, 4.0, 4.8, 7.4, 10.0, 13.0, 16.0), Verdict.SUCCEEDED),  # one too soon is no matter
        ((), Verdict.UNKNOWN),
    ],
)
def test_a_stage_succeeds_in_rhythm_and_fails_out_of_it(
    onsets: Sequence[float], verdict: Verdict
) -> None:
    assert finish(task_of(wiped(onsets, 20.0))) is verdict


def test_a_rhythm_lasts_until_the_next_stage_begins() -> None:
    text = """<clean> ::= <wipe> <done>
    <wipe> ::= touching(wiper, glass) every 4 s
    <done> ::= touching(cup, glass)"""
    played = wiped(IN_TIME, 22.0, text, [RelationSpan("touching", 17.0, 22.0, (CUP, GLASS))])
    assert task_of(played, 15.0).stages[0].status is Status.PROGRESSING
    assert finish(task_of(played)) is Verdict.SUCCEEDED


def test_missed_beats_and_recoveries_are_reported() -> None:
    played = wiped((1.0, 4.0, 10.4, 13.0, 15.8), 18.0)
    texts = [e.text for e in played.events if e.kind == "stage_failing"]
    assert texts == [
        "Stage `wipe` is failing: the wiper and the glass have been out of time since 8.2 s; "
        "stage `wipe` requires them to be touching every 2 s to 4 s."
    ]
    assert task_of(played).stages[0].status is Status.PROGRESSING


def test_a_pause_stops_the_clock_of_a_rhythm() -> None:
    text = WIPE + " pauses when touching(cup, wiper)"
    pause = RelationSpan("touching", 7.9, 14.1, (CUP, WIPER))
    onsets = (1.0, 4.0, 7.0, 16.0, 19.0, 22.0)
    assert finish(task_of(wiped(onsets, 24.0, text, [pause]))) is Verdict.SUCCEEDED
    assert finish(task_of(wiped(onsets, 24.0))) is Verdict.FAILED


def test_a_rhythm_can_be_used_in_conditions_and_invariants() -> None:
    text = """<hold> ::= touching(cup, glass) for 10 s fails when not touching(wiper, glass) every 4 s
    always touching(wiper, glass) every 6 s for 2 s"""
    hold = [RelationSpan("touching", 1.0, 30.0, (CUP, GLASS))]
    assert finish(task_of(wiped(IN_TIME, 14.0, text, hold))) is Verdict.SUCCEEDED
    late = wiped((1.0,), 8.0, text, hold)
    assert task_of(late).stages[0].status is Status.FAILING
    broken = [e for e in wiped((1.0,), 12.0, text, hold).events if e.kind == "invariant_broken"]
    assert len(broken) == 1
