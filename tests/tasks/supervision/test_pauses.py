"""`pauses when`: while work is paused no clock runs, and nothing is done or fails."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from tests.tasks.scripted import RelationSpan, Script, ScriptedRun, mind_at, play, task_of
from visup.agent import Mind, Observation, Status, Truth, Verdict
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import finish, task_reasoner
from visup.tasks.verification.pauses import MAX_SPANS, PauseRecord

ARM, PART, TRAY, GUARD = 1, 2, 3, 4
NAMES = {ARM: {"arm": 0.9}, PART: {"part": 0.9}, TRAY: {"tray": 0.9}, GUARD: {"guard": 0.9}}
PAUSE = "pauses when touching(guard, arm)"
TASKS = (
    """<put>    ::= ((<grasp> <carry> <place>) within 14 s) {}
       <grasp>  ::= touching(arm, part) for 2 s
       <carry>  ::= converging(part, tray)
       <place>  ::= touching(part, tray) after 1 s to 6 s""",
    """<put>    ::= (<grasp> (<carry> | <back>)) {}
       <grasp>  ::= coupled(arm, part) within 9 s
       <carry>  ::= moving_together(arm, part) & converging(part, tray) for 2 s
       <back>   ::= diverging(arm, part) decoupled(arm, part)""",
    """<put>    ::= any order (<grasp>, <place>) {}
       <grasp>  ::= touching(arm, part)
       <place>  ::= touching(part, tray) fails when diverging(part, tray) for 1 s""",
)
FPS = 5.0
UNEVEN = 1 / 0.19
"""Frames a second such that no two are as far apart as any patience, to the last bit."""
UNTIL = 24


def script(spans: list[RelationSpan]) -> Script:
    return Script(tuple(spans), objects=dict.fromkeys(NAMES, (0.0, 1e9)), identities=NAMES)


def paused_for(begins: float, lasts: float) -> RelationSpan:
    return RelationSpan("touching", begins, begins + lasts, (ARM, GUARD))


def cut(text: str, scene: Script) -> list[tuple[int, Mind]]:
    """What comes of the same recording with the pauses cut out, by the number of the frame."""
    reasoner, mind, paused_s, before = task_reasoner([parse_task(text)]), Mind(), 0.0, 0.0
    guarded = [s for s in scene.spans if GUARD in s.objects]
    frames: list[tuple[int, Mind]] = []
    spans: list[tuple[float, float]] = []
    for index in range(round(UNTIL * UNEVEN) + 1):
        time = index / UNEVEN
        if any(s.from_s <= time < s.to_s for s in guarded):
            spans.append((before, time))
            paused_s += time - before
            before = time
            continue
        before = time
        shifted_mind = mind_at(scene, time, index, mind)
        shifted = tuple(replace(r, since=_moved(r.since, spans)) for r in shifted_mind.relations)
        shifted_mind = replace(shifted_mind, time=time - paused_s, relations=shifted)
        mind = reasoner(shifted_mind, Observation(index, time - paused_s, (640, 480))).mind
        frames.append((index, mind))
    return frames


def _moved(time: float, spans: list[tuple[float, float]]) -> float:
    return time - sum(max(0.0, min(time, end) - start) for start, end in spans)


def statuses(mind: Mind) -> list[tuple[str, Status]]:
    return [(s.stage, s.status) for s in mind.tasks[0].stages]


tenths = st.integers(0, 10 * UNTIL).map(lambda n: n / 10 + 0.037)
pairs = st.sampled_from([(ARM, PART), (PART, TRAY)])
names = st.sampled_from(["converging", "diverging", "touching", "coupled", "moving_together"])
span = st.builds(
    lambda name, pair, at, lasts: RelationSpan(name, at, at + lasts, pair),
    names, pairs, tenths, st.integers(5, 80).map(lambda n: n / 10),
)  # fmt: skip
guarding = st.builds(
    paused_for, tenths.filter(lambda t: t > 0.5), st.integers(3, 90).map(lambda n: n / 10)
)


@settings(max_examples=8, phases=[Phase.explicit, Phase.generate])
@given(
    st.sampled_from(TASKS), st.lists(span, max_size=7), st.lists(guarding, min_size=1, max_size=3)
)
def test_a_pause_is_equivalent_to_cutting_it_out_of_the_recording(
    text: str, spans: list[RelationSpan], pauses: list[RelationSpan]
) -> None:
    scene = script([*spans, *pauses])
    played = play(task_reasoner([parse_task(text.format(PAUSE))]), scene, UNTIL, UNEVEN)
    for index, twin in cut(text.format(""), scene):
        mind = played.minds[index]
        assert statuses(mind) == statuses(twin)
        assert mind.tasks[0].verdict is twin.tasks[0].verdict
        assert mind.tasks[0].confidence == pytest.approx(twin.tasks[0].confidence, abs=1e-6)


GRASP = """<put>   ::= <grasp> <lift>
<grasp> ::= touching(arm, part) {}
<lift>  ::= converging(part, tray) for 1 s"""


def watched(
    clauses: str, *spans: RelationSpan, text: str = GRASP, until: float = 20.0
) -> ScriptedRun:
    reasoner = task_reasoner([parse_task(text.format(clauses))])
    return play(reasoner, script(list(spans)), until, FPS)


TOUCH = RelationSpan("touching", 1.0, 4.0, (ARM, PART))
AGAIN = RelationSpan("touching", 9.0, 14.0, (ARM, PART))
LIFT = RelationSpan("converging", 14.0, 19.0, (PART, TRAY))


@pytest.mark.parametrize(
    ("clauses", "good"),
    [
        ("for 6 s", False),
        (f"for 6 s {PAUSE}", True),
        ("within 9 s for 6 s", False),
        (f"for 6 s within 9 s {PAUSE}", True),
        (f"for 6 s {PAUSE} or touching(guard, part)", True),
    ],
)
def test_a_pause_does_not_interrupt_a_duration(clauses: str, good: bool) -> None:
    played = watched(clauses, TOUCH, paused_for(3.8, 5.4), AGAIN, LIFT)
    assert (finish(task_of(played)) is Verdict.SUCCEEDED) == good


@pytest.mark.parametrize("inside", [True, False])
def test_a_time_limit_around_a_paused_stage_keeps_running(inside: bool) -> None:
    clauses = f"within 4 s {PAUSE}" if inside else f"{PAUSE}"
    text = "<put> ::= <grasp>\n<grasp> ::= touching(arm, part) for 3 s {}"
    text = text if inside else text.replace("<grasp>\n", "<grasp> within 4 s\n")
    spans = (RelationSpan("touching", 0.0, 2.0, (ARM, PART)), paused_for(1.8, 8.4))
    again = RelationSpan("touching", 10.0, 20.0, (ARM, PART))
    played = watched(clauses, *spans, again, text=text)
    assert (finish(task_of(played)) is Verdict.SUCCEEDED) == inside


def test_a_pause_and_its_end_are_reported() -> None:
    played = watched(f"for 6 s {PAUSE}", TOUCH, paused_for(3.8, 5.4), AGAIN, LIFT)
    reported = [
        (e.time, e.kind, e.text)
        for e in played.events
        if e.kind in ("stage_paused", "stage_resumed")
    ]
    assert reported == [
        (
            3.8,
            "stage_paused",
            "Stage `grasp` is paused: the guard and the arm have been touching since 3.8 s.",
        ),
        (
            9.2,
            "stage_resumed",
            "Stage `grasp` has resumed: the arm and the part have been touching since 9.0 s.",
        ),
    ]
    assert task_of(played, 6.0).stages[0].status is Status.PAUSED
    assert task_of(played, 6.0).verdict is Verdict.IN_PROGRESS


@pytest.mark.parametrize(
    ("condition", "reason"),
    [
        ("apart(guard, part)", "the guard and the part have been apart since 0.0 s"),
        ("gap(arm, part) < 9 px", "the arm and the part have been at a gap below 9 px since 0.0 s"),
        ("signal_on(hold) or apart(guard, part)", "`signal_on(hold) or apart(guard, part)` since"),
    ],
)
def test_the_cause_of_a_pause_is_explained(condition: str, reason: str) -> None:
    scene = replace(script([TOUCH]), gaps=lambda time: 5.0)
    reasoner = task_reasoner([parse_task(GRASP.format(f"pauses when {condition}"))])
    stage = task_of(play(reasoner, scene, 3.0, FPS)).stages[0]
    assert stage.status is Status.PAUSED
    assert reason in stage.evidence


def test_invariants_apply_during_a_pause() -> None:
    text = GRASP + "\nnever touching(part, tray)"
    spans = (TOUCH, paused_for(3.0, 6.0), RelationSpan("touching", 5.0, 7.0, (PART, TRAY)))
    assert finish(task_of(watched(PAUSE, *spans, text=text))) is Verdict.INTERRUPTED


def test_a_failing_stage_is_not_paused() -> None:
    away = RelationSpan("diverging", 3.0, 30.0, (ARM, PART))
    played = watched(f"for 6 s {PAUSE}", TOUCH, away, paused_for(6.0, 12.0))
    assert {task_of(played, t).stages[0].status for t in (5.8, 8.0, 17.0)} == {Status.FAILING}
    assert not [e for e in played.events if e.kind == "stage_paused"]


def test_a_pause_condition_can_require_a_duration() -> None:
    played = watched(f"for 6 s {PAUSE} for 1 s", TOUCH, paused_for(2.0, 5.0), AGAIN, LIFT)
    assert task_of(played, 2.8).stages[0].status is Status.PROGRESSING
    assert task_of(played, 3.2).stages[0].status is Status.PAUSED


def test_a_pause_lasts_two_seconds_after_its_cause_is_hidden() -> None:
    hold = RelationSpan("touching", 1.0, 20.0, (ARM, PART))
    scene = replace(script([hold, paused_for(2.0, 2.0)]), hidden={GUARD: (4.0, 9.0)})
    reasoner = task_reasoner([parse_task(GRASP.format(f"for 12 s {PAUSE}"))])
    played = play(reasoner, scene, 10.0, FPS)
    assert task_of(played, 5.0).stages[0].status is Status.PAUSED
    assert task_of(played, 6.4).stages[0].status is not Status.PAUSED


def test_pauses_around_and_inside_both_count() -> None:
    text = "<put> ::= (<grasp> pauses when touching(guard, part))\n<grasp> ::= touching(arm, part) for 4 s {}"
    other = RelationSpan("touching", 8.0, 12.0, (PART, GUARD))
    hold = RelationSpan("touching", 1.0, 20.0, (ARM, PART))
    played = watched(PAUSE, hold, paused_for(2.0, 4.0), other, text=text)
    stage = [task_of(played, t).stages[0].status for t in (3.0, 7.0, 9.0)]
    assert stage == [Status.PAUSED, Status.PROGRESSING, Status.PAUSED]
    assert task_of(played, 12.4).verdict is Verdict.IN_PROGRESS
    assert finish(task_of(played)) is Verdict.SUCCEEDED


def test_the_record_of_many_pauses_is_bounded_and_exact() -> None:
    (condition,) = parse_task(f"<put> ::= touching(arm, part) {PAUSE}").stages[0].body.conditions  # type: ignore[union-attr]
    record = PauseRecord()
    (relation,) = [r for r in mind_at(script([paused_for(0.0, 1e9)]), 1.0, 0, Mind()).relations
                   if set(r.objects) == {ARM, GUARD} and r.name == "touching"]  # fmt: skip
    for k in range(4 * MAX_SPANS):
        observed = relation if k % 2 else replace(relation, truth=Truth.FALSE)
        record = record.noted([condition], lambda _, s=observed: s, float(k), k + 1.0, 2.0)  # type: ignore[misc]
    assert len(record.pauses[0].spans) == MAX_SPANS
    assert record.elapsed([condition], 0.0, 4.0 * MAX_SPANS) == 2.0 * MAX_SPANS
