"""Rendered missions, seen through percepts made from their truth with noise."""

from functools import lru_cache

import pytest

from tests.rules.percepts_from_truth import Noise, actors_of, available, observations
from tests.rules.runs import Thought, dock, reason
from visup.agent import Presence, Truth

pytestmark = pytest.mark.skipif(
    not available("capture_fails"), reason="the shared missions are not beside this repository"
)


@lru_cache(maxsize=8)
def run(name: str, noise: Noise) -> tuple[list[Thought], dict[int, str]]:
    """Thoughts, and what each region is in truth."""
    who: dict[int, str] = {}
    seen = []
    for observation, truth in observations(name, noise):
        seen.append(observation)
        who.update(truth)
    return reason(seen, dock, actors=actors_of(name)), who


def events(name: str, noise: Noise) -> list[tuple[str, tuple[str, ...], float]]:
    thoughts, who = run(name, noise)
    return [
        (e.kind, tuple(sorted(who[i] for i in e.objects)), e.time)
        for t in thoughts
        for e in t.events
        if e.kind not in ("identified", "relation")
    ]


def true_times(name: str, noise: Noise, relation: str) -> list[float]:
    """When the relation of arm and satellite was true."""
    thoughts, _ = run(name, noise)
    found = ((t.mind.time, t.mind.relation(relation, 1, 2)) for t in thoughts)
    return [time for time, r in found if r is not None and r.truth is Truth.TRUE]


HALF, THIRD = Noise(seed=11, every=2), Noise(seed=12, every=3)
ROUGH = Noise(seed=13, every=3, contour_px=2.0, missing=0.15, wrong=0.3)


def test_a_capture_that_fails_is_converging_touching_diverging_and_never_coupled() -> None:
    converging = true_times("capture_fails", THIRD, "converging")
    assert converging[0] < 4.5
    assert 10.0 < converging[-1] < 13.0
    touching = true_times("capture_fails", THIRD, "touching")
    assert 10.0 < touching[0] < 12.0
    assert 13.0 < touching[-1] < 14.5
    diverging = true_times("capture_fails", THIRD, "diverging")
    assert 12.0 < diverging[0] < 14.0
    assert diverging[-1] > 29.0
    assert [k for k, _, _ in events("capture_fails", THIRD)] == ["entry", "entry"]


def test_a_capture_that_succeeds_is_coupled() -> None:
    told = events("capture_succeeds", HALF)
    assert [k for k, _, _ in told] == ["entry", "entry", "coupled"]
    assert told[-1][1] == ("arm", "satellite")
    assert told[-1][2] == pytest.approx(12.0, abs=1.5)
    assert not [t for t in true_times("capture_succeeds", HALF, "diverging") if t > 12.0]


def test_an_approach_that_is_aborted_never_touches() -> None:
    assert true_times("approach_aborted", THIRD, "converging")[0] < 5.0
    assert not true_times("approach_aborted", THIRD, "touching")
    diverging = true_times("approach_aborted", THIRD, "diverging")
    assert 12.0 < diverging[0] < 14.5
    assert [k for k, _, _ in events("approach_aborted", THIRD)] == ["entry", "entry"]


@pytest.mark.parametrize("noise", [THIRD, ROUGH], ids=["third", "rough"])
def test_what_an_intruder_hides_reappears_as_itself(noise: Noise) -> None:
    told = [e for e in events("occlusion_by_intruder", noise) if e[2] > 2.0]
    expected = [
        ("entry", "intruder", 6.36),
        ("occlusion", "satellite", 9.68),
        ("reappearance", "satellite", 13.28),
        ("occlusion", "arm", 13.4),
        ("reappearance", "arm", 14.96),
        ("exit", "intruder", 16.2),
    ]
    assert [(k, o) for k, (o,), _ in told] == [(k, o) for k, o, _ in expected]
    assert [t for _, _, t in told] == pytest.approx([t for _, _, t in expected], abs=1.0)
    thoughts, _ = run("occlusion_by_intruder", noise)
    assert {b.id: b.name for b in thoughts[-1].mind.present()} == {
        1: "rms_arm",
        2: "spartan201_approx",
    }
    assert thoughts[-1].mind.objects[3].presence is Presence.LEFT
    assert {c.kind for t in thoughts for c in t.conditions} == {"unexpected_object"}


def test_an_intruder_that_comes_near_is_unexpected_and_on_a_collision_course() -> None:
    thoughts, who = run("intruder_on_collision_course", THIRD)
    first: dict[tuple[str, tuple[str, ...]], float] = {}
    for t in thoughts:
        for c in t.conditions:
            key = (c.kind, tuple(sorted(who[i] for i in c.objects)))
            first.setdefault(key, t.mind.time)
    assert set(first) == {
        ("unexpected_object", ("intruder",)),
        ("collision_course", ("intruder", "satellite")),
    }
    assert first["unexpected_object", ("intruder",)] < 10.0
    assert first["collision_course", ("intruder", "satellite")] < 12.0
    told = [e for e in events("intruder_on_collision_course", THIRD) if e[2] > 2.0]
    assert [(k, o) for k, o, _ in told] == [
        ("entry", ("intruder",)),
        ("coupled", ("arm", "satellite")),
    ]
    assert told[0][2] == pytest.approx(9.2, abs=1.0)
    assert told[1][2] == pytest.approx(20.0, abs=1.5)


def test_thinking_is_a_pure_function() -> None:
    """The same percepts give the same story; a mind that was kept is as it was."""
    name, noise = "capture_fails", Noise(seed=3, every=5)
    seen = [o for o, _ in observations(name, noise)][:60]
    stories = [
        [(t.mind.time, t.events, t.mind.relations, t.conditions)
         for t in reason(seen, actors=actors_of(name))]
        for _ in range(2)
    ]  # fmt: skip
    assert stories[0] == stories[1]
