from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tasks.scripted import (
    ARM,
    DOCK,
    INTRUDER,
    RETRIES,
    SATELLITE,
    RelationSpan,
    Script,
    ScriptedRun,
    play,
    task_of,
    watch,
)
from visup.agent import Expectation, Severity, Status, Truth, Verdict
from visup.tasks import load_task
from visup.tasks.supervision.supervise import finish, task_reasoner

FAILS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 12.8),
    RelationSpan("diverging", 12.8, 30),
)
SUCCEEDS = (
    RelationSpan("converging", 0.5, 12.3),
    RelationSpan("touching", 12.0, 30),
    RelationSpan("moving_together", 12.6, 30),
    RelationSpan("coupled", 13.0, 30),
)
ABORTED = (RelationSpan("converging", 0.5, 11.5), RelationSpan("diverging", 12.5, 20))
CROWDED = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (6.5, 1e9)}


def status(played: ScriptedRun, stage: str, time: float | None = None) -> Status:
    return next(s.status for s in task_of(played, time).stages if s.stage == stage)


def test_capture_fails_as_in_the_paper() -> None:
    played = watch(Script(FAILS), 30.0)
    reported = [
        (k, s) for k, s in played.reported() if k not in ("stage_progressing", "stage_failed")
    ]
    assert reported == [
        ("stage_started", "approach"),
        ("stage_done", "approach"),
        ("stage_started", "captured"),
        ("stage_failing", "captured"),
        ("verdict", ""),
    ]
    assert task_of(played, 8.0).current == "approach"
    assert status(played, "approach", 8.0) is Status.PROGRESSING
    assert task_of(played, 12.5).current == "captured"
    failing = next(e for e in played.events if e.kind == "stage_failing")
    assert 12.8 <= failing.time <= 14.3
    assert failing.severity is Severity.WARNING
    assert failing.text == (
        "Stage `captured` is failing: the arm and the satellite have been diverging since 12.8 s; "
        "stage `captured` requires them to be coupled."
    )
    assert status(played, "captured", 25.0) in (Status.FAILING, Status.FAILED)
    assert finish(task_of(played)) is Verdict.FAILED


def test_capture_succeeds() -> None:
    played = watch(Script(SUCCEEDS), 26.0)
    assert task_of(played).verdict is Verdict.SUCCEEDED
    assert [s.status for s in task_of(played).stages] == [Status.DONE, Status.DONE]
    assert not [c for o in played.outcomes for c in o.conditions]
    assert task_of(played, 10.0).verdict is Verdict.IN_PROGRESS


def test_a_stage_wrongly_reported_complete_is_revised() -> None:
    let_go = RelationSpan("coupled", 13.0, 15.0), RelationSpan("moving_together", 12.6, 15.0)
    played = watch(
        Script(
            (
                *SUCCEEDS[:1],
                RelationSpan("touching", 12.0, 15.0),
                *let_go,
                RelationSpan("diverging", 15.0, 30),
            )
        ),
        18.0,
    )
    reported = [
        e.text.partition(":")[0] for e in played.events if e.data.get("stage") == "captured"
    ]
    assert reported[-2:] == [
        "Stage `captured` is complete",
        "Stage `captured` is no longer complete",
    ]


def test_an_aborted_approach_fails_before_the_capture() -> None:
    played = watch(Script(ABORTED), 24.0)
    assert status(played, "captured") is Status.PENDING
    assert finish(task_of(played, 14.0)) is Verdict.FAILED
    assert task_of(played, 14.0).verdict is Verdict.IN_PROGRESS
    assert finish(task_of(played)) is Verdict.FAILED
    assert status(played, "approach", 22.0) in (Status.FAILING, Status.FAILED)
    condition = next(o for o in played.outcomes if o.mind.time == 15.0).conditions[0]
    assert (condition.kind, condition.severity, condition.key) == (
        "stage_failing",
        Severity.WARNING,
        "dock/approach",
    )


def test_an_unsafe_event_interrupts_the_task_permanently() -> None:
    script = Script(SUCCEEDS, objects=CROWDED, alerts=[("unexpected_object", 7.0, 9.0)])
    played = watch(script, 26.0)
    assert task_of(played, 6.8).verdict is Verdict.IN_PROGRESS
    assert task_of(played, 7.0).verdict is Verdict.INTERRUPTED
    assert status(played, "captured") is Status.DONE
    assert finish(task_of(played)) is Verdict.INTERRUPTED
    assert task_of(played, 7.0).unexplained == (INTRUDER,)
    assert task_of(played, 6.0).unexplained == ()


@pytest.mark.parametrize(
    ("kind", "about", "ends"),
    [
        ("unexpected_object", ARM, True),  # it was the arm all the time
        ("unexpected_object", INTRUDER, False),
        ("collision_course", ARM, False),  # whoever it was, it was unsafe
    ],
)
def test_an_unknown_object_identified_as_an_actor_no_longer_interrupts(
    kind: str, about: int, ends: bool
) -> None:
    script = Script(SUCCEEDS, objects=CROWDED, alerts=[(kind, 7.0, 9.0)], about=(about,))
    played = watch(script, 26.0)
    assert task_of(played, 8.0).verdict is Verdict.INTERRUPTED
    after = Verdict.IN_PROGRESS if ends else Verdict.INTERRUPTED
    assert task_of(played, 10.0).verdict is after
    assert finish(task_of(played)) is (Verdict.SUCCEEDED if ends else Verdict.INTERRUPTED)


@pytest.mark.parametrize("kind", ["stage_failing", "contact"])
def test_other_alerts_do_not_interrupt(kind: str) -> None:
    played = watch(Script(SUCCEEDS, alerts=[(kind, 7.0, 9.0)]), 26.0)
    assert task_of(played).verdict is Verdict.SUCCEEDED


def test_the_verdict_on_an_unobserved_task_is_unknown() -> None:
    alone = Script(objects={INTRUDER: (0.0, 1e9)})
    played = watch(alone, 10.0)
    assert finish(task_of(played)) is Verdict.UNKNOWN
    assert task_of(played).current is None
    still = watch(Script(), 10.0)
    assert finish(task_of(still)) is Verdict.UNKNOWN


def test_a_task_that_is_unfinished_at_the_end_is_in_progress() -> None:
    played = watch(Script(FAILS), 10.0)
    assert finish(task_of(played)) is Verdict.IN_PROGRESS


def test_hidden_actors_make_a_stage_unknown_and_never_failed() -> None:
    hidden = Script(SUCCEEDS, hidden={SATELLITE: (4.0, 9.0)})
    played = watch(hidden, 26.0)
    assert status(played, "approach", 5.0) is Status.PROGRESSING
    assert status(played, "approach", 8.0) is Status.UNKNOWN
    assert status(played, "approach", 9.5) is Status.PROGRESSING
    assert [b.object_id for b in task_of(played, 8.0).bindings] == [ARM, SATELLITE]
    assert task_of(played).verdict is Verdict.SUCCEEDED


def test_an_approach_without_progress_is_stalled_and_can_continue() -> None:
    spans = (
        RelationSpan("converging", 0, 5),
        RelationSpan("converging", 11, 15),
        RelationSpan("touching", 15, 30),
    )
    played = watch(Script(spans), 16.0)
    assert status(played, "approach", 10.0) is Status.STALLED
    assert status(played, "approach", 12.0) is Status.PROGRESSING
    assert status(played, "approach") is Status.DONE


def test_brief_contrary_motion_is_no_failure_and_a_recovery_ends_one() -> None:
    brief = (
        RelationSpan("converging", 0, 5),
        RelationSpan("diverging", 5, 5.4),
        RelationSpan("converging", 5.4, 9),
    )
    assert "stage_failing" not in dict(watch(Script(brief), 9.0).reported())
    longer = (
        RelationSpan("converging", 0, 5),
        RelationSpan("diverging", 5, 7),
        RelationSpan("converging", 7, 12),
    )
    played = watch(Script(longer), 12.0)
    assert status(played, "approach", 6.5) is Status.FAILING
    assert status(played, "approach") is Status.PROGRESSING
    assert finish(task_of(played)) is Verdict.IN_PROGRESS


def test_a_failed_stage_recovers_only_after_as_long_a_success() -> None:
    spans = (
        RelationSpan("converging", 0, 5),
        RelationSpan("diverging", 5, 15),
        RelationSpan("converging", 15, 30),
    )
    played = watch(Script(spans), 25.0)
    assert task_of(played, 14.5).verdict is Verdict.FAILED
    assert task_of(played, 22.0).verdict is Verdict.FAILED
    assert status(played, "approach") is Status.PROGRESSING
    assert task_of(played).verdict is Verdict.IN_PROGRESS


def bobbing(nearest: float) -> Script:
    """Two that met part again, to 40 pixels, and then draw nearer for a while."""
    spans = (
        RelationSpan("converging", 0, 4),
        RelationSpan("touching", 4, 6),
        RelationSpan("diverging", 6, 9),
        RelationSpan("converging", 10, 14),
    )
    times, gaps = (0.0, 4.0, 6.0, 9.0, 10.0, 13.0), (80.0, 0.0, 0.0, 40.0, 40.0, nearest)
    return Script(spans, gaps=lambda t: float(np.interp(t, times, gaps)))


@pytest.mark.parametrize(("nearest", "mended"), [(36.0, False), (24.0, False), (8.0, True)])
def test_a_separation_is_recovered_by_returning_half_the_distance(
    nearest: float, mended: bool
) -> None:
    berth = "<t> ::= <near> <stay>\n<near> ::= converging(arm, satellite)\n"
    played = watch(bobbing(nearest), 14.0, berth + "<stay> ::= touching(arm, satellite) for 5 s")
    assert status(played, "stay", 9.5) is Status.FAILING
    assert (status(played, "stay") is Status.PROGRESSING) is mended


def test_a_capture_that_is_lost_immediately_fails() -> None:
    lost = (
        RelationSpan("converging", 0, 12),
        RelationSpan("touching", 12, 14.5),
        RelationSpan("coupled", 12.2, 14.0),
        RelationSpan("diverging", 14.5, 30),
    )
    played = watch(Script(lost), 30.0)
    assert task_of(played, 13.8).verdict is Verdict.SUCCEEDED
    assert finish(task_of(played)) is Verdict.FAILED
    assert status(played, "captured", 16.0) is Status.FAILING


def test_relations_of_the_current_and_next_stage_are_expected() -> None:
    played = watch(Script(SUCCEEDS), 20.0)
    pair = (ARM, SATELLITE)
    early = set(task_of(played, 5.0).expected)
    assert {Expectation("converging", pair), Expectation("touching", pair)} <= early
    late = set(task_of(played, 12.6).expected)
    assert {Expectation(n, pair) for n in ("coupled", "converging", "touching")} <= late


RETRY = load_task("dock_with_retry")


def test_a_retreat_is_a_retry_if_the_task_allows_it() -> None:
    played = play(task_reasoner([RETRY]), Script(RETRIES), 30.0)
    assert task_of(played).verdict is Verdict.SUCCEEDED
    assert "stage_failing" not in dict(played.reported())
    assert task_of(played, 8.0).current == "back_off"
    assert task_of(played, 14.0).current == "approach"
    assert finish(task_of(watch(Script(RETRIES), 20.0))) is not Verdict.SUCCEEDED


def test_actors_are_rebound_only_after_a_while() -> None:
    reasoner = task_reasoner([DOCK])
    played = play(reasoner, Script(SUCCEEDS), 5.0)
    swapped = Script(SUCCEEDS, identities={ARM: {"satellite": 0.9}, SATELLITE: {"arm": 0.9}})
    from tests.tasks.scripted import mind_at
    from visup.agent import Observation

    mind = played.last
    for i in range(1, 40):
        mind = mind_at(swapped, 5.0 + i / 10, 50 + i, mind)
        mind = reasoner(mind, Observation(50 + i, mind.time, (640, 480))).mind
        bound = [b.object_id for b in mind.tasks[0].bindings]
        assert bound == ([ARM, SATELLITE] if mind.time < 7.1 - 1e-9 else [SATELLITE, ARM])


SCENES = {"fails": (FAILS, 24.0), "succeeds": (SUCCEEDS, 24.0), "aborted": (ABORTED, 24.0)}


@cache
def watched(name: str) -> ScriptedRun:
    spans, until = SCENES[name]
    return watch(Script(spans), until, fps=10.0)


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(sorted(SCENES)), st.floats(0.0, 20.0))
def test_shifting_a_scene_in_time_shifts_its_events(name: str, shift: float) -> None:
    spans, until = SCENES[name]
    shift = round(shift, 1)
    moved = tuple(replace(s, from_s=s.from_s + shift, to_s=s.to_s + shift) for s in spans)
    objects = {ARM: (shift, 1e9), SATELLITE: (shift, 1e9)}
    original = watched(name)
    shifted = watch(Script(moved, objects=objects), until + shift, fps=10.0)
    assert shifted.reported() == original.reported()
    for a, b in zip(original.events, shifted.events, strict=True):
        assert b.time - a.time == pytest.approx(shift, abs=0.11)


@pytest.mark.parametrize("fps", [4.0, 10.0, 25.0])
@pytest.mark.parametrize("name", sorted(SCENES))
def test_events_do_not_depend_on_the_frame_rate(name: str, fps: float) -> None:
    spans, until = SCENES[name]
    assert watch(Script(spans), until, fps=fps).reported() == watched(name).reported()


def test_a_reasoner_is_a_pure_function_without_state() -> None:
    reasoner = task_reasoner([DOCK])
    played = play(reasoner, Script(FAILS), 20.0)
    again = play(reasoner, Script(FAILS), 20.0)
    assert [m.tasks for m in again.minds] == [m.tasks for m in played.minds]
    assert again.events == played.events
    hash(played.last.memory["tasks"][0].posterior.likeliest.state)


def test_several_tasks_are_supervised_concurrently() -> None:
    played = play(task_reasoner([DOCK, RETRY]), Script(RETRIES), 30.0)
    assert [t.task for t in played.last.tasks] == ["dock", "dock_with_retry"]
    assert played.last.tasks[1].verdict is Verdict.SUCCEEDED


@pytest.mark.parametrize("share", [0.05, 0.1])
def test_occasionally_wrong_relations_do_not_change_the_verdict(share: float) -> None:
    for seed in range(4):
        for name, (spans, until) in SCENES.items():
            noisy = _with_noise(spans, until, share, seed)
            verdict = finish(task_of(watch(Script(noisy), until)))
            expected = Verdict.SUCCEEDED if name == "succeeds" else Verdict.FAILED
            assert verdict is expected, (name, seed)


def _with_noise(
    spans: tuple[RelationSpan, ...], until: float, share: float, seed: int
) -> tuple[RelationSpan, ...]:
    """Single frames in which something false is seen or nothing is known."""
    import random

    rng = random.Random(seed)
    wrong = []
    for i in range(round(until * 10)):
        if rng.random() < share:
            name = rng.choice(["converging", "diverging", "keeping_distance", "touching"])
            truth = rng.choice([Truth.TRUE, Truth.UNKNOWN, Truth.FALSE])
            wrong.append(RelationSpan(name, i / 10, (i + 1) / 10 - 1e-6, truth=truth))
    return (*wrong, *spans)
