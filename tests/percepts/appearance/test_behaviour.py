"""Laws of taught things that are seen: named, steady at rest, one id through all that happens to them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache

import numpy as np
import pytest

from tests.percepts.appearance.scenes import HEIGHT, WIDTH, picture, shown
from visup.agent import (
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)
from visup.agent.execution.validation import check_percepts
from visup.agent.storage.checkpoint import dump_state, load_state
from visup.percepts.appearance.behaviour import AppearanceBehaviour

FPS = 15.0
Places = Mapping[str, tuple[int, int]]
START: Places = {"tray": (150, 110), "part": (40, 60)}


def look(
    behaviour: AppearanceBehaviour,
    number: int,
    places: Places,
    health: Health | None = None,
    light: float = 1.0,
) -> dict[str, Region]:
    """The named regions of one frame."""
    image, _ = picture(places, seed=number)
    image = (image * light).astype(np.uint8)
    frame = Frame(number, number / FPS, image)
    reports: tuple[Report, ...] = ()
    if health is not None:
        said = Percept("health", health, frame.time, "health")
        reports = (Report("health", ReportState.RAN, ("health",), (said,)),)
    seen = Observation(number, frame.time, frame.size, reports)
    percepts = tuple(behaviour.perceive(frame, seen, ()))
    check_percepts(behaviour.contract, percepts, frame)
    regions = {p.value.id: p.value for p in percepts if isinstance(p.value, Region)}
    names = [p.value for p in percepts if isinstance(p.value, Hypothesis)]
    return {h.name: regions[h.region_id] for h in names}


def watch(behaviour: AppearanceBehaviour, course: Iterable[Places]) -> list[dict[str, Region]]:
    return [look(behaviour, n, places) for n, places in enumerate(course)]


def iou(region: Region, places: Places, name: str) -> float:
    mask = region.full_mask((WIDTH, HEIGHT))
    true = picture(places)[1][name]
    return float(np.count_nonzero(mask & true) / np.count_nonzero(mask | true))


def carried(steps: int) -> list[Places]:
    """The part rests, is carried to the tray by a tool that covers half of it, and is left there."""
    out: list[Places] = [START] * 10
    for k in range(steps):
        x, y = 40 + round(130 * k / steps), 60 + round(55 * k / steps)
        out.append({"tray": (150, 110), "part": (x, y), "tool": (x + 4, y - 48)})
    end = {"tray": (150, 110), "part": (170, 115)}
    return [*out, *[end | {"tool": (174, 67 - 6 * k)} for k in range(8)], *[end] * 4]


@cache
def seen_carried() -> tuple[dict[str, Region], ...]:
    """What is seen of a part that is carried in 26 steps; several tests read it."""
    return tuple(watch(AppearanceBehaviour(shown(START, "part", "tray")), carried(26)))


@pytest.mark.parametrize("light", [0.4, 0.6])
def test_things_are_found_in_other_light_by_the_views_that_were_taught(light: float) -> None:
    elsewhere = shown({"tray": (20, 20), "part": (180, 120)}, "tray", "part", "part")
    behaviour = AppearanceBehaviour(elsewhere)
    for number in range(4):
        seen = look(behaviour, number, START, light=light)
        assert {n for n in seen if iou(seen[n], START, n) > 0.8} == {"tray", "part"}
    # A behaviour that goes on from there knows the same views, and their light.
    other = AppearanceBehaviour(elsewhere)
    other.load(load_state(dump_state(behaviour.save())))
    again = look(other, 4, START, light=light)
    assert {n: r.id for n, r in again.items()} == {n: r.id for n, r in seen.items()}
    assert all(h.view in (0, 1) for h in names_of(other, 5, START, light))


def names_of(
    behaviour: AppearanceBehaviour, number: int, places: Places, light: float
) -> list[Hypothesis]:
    """The hypotheses of one frame."""
    image = (picture(places, seed=number)[0] * light).astype(np.uint8)
    frame = Frame(number, number / FPS, image)
    percepts = behaviour.perceive(frame, Observation(number, frame.time, frame.size, ()), ())
    return [p.value for p in percepts if isinstance(p.value, Hypothesis)]


def test_things_at_rest_are_named_and_keep_exactly_their_mask() -> None:
    seen = watch(AppearanceBehaviour(shown(START, "part", "tray")), [START] * 6)
    for name in START:
        assert all(iou(s[name], START, name) > 0.8 for s in seen)
        assert all(np.array_equal(s[name].mask, seen[1][name].mask) for s in seen[1:])
        assert all(s[name].velocity == (0.0, 0.0) for s in seen)


def test_a_part_keeps_its_id_and_its_mask_while_it_is_carried() -> None:
    course, seen = carried(26), seen_carried()
    good = [
        s.get("part") is not None and iou(s["part"], p, "part") > 0.5
        for s, p in zip(seen, course, strict=True)
    ]
    assert np.mean(good) > 0.9
    assert len({s["part"].id for s in seen if "part" in s}) == 1
    assert seen[-1]["part"].id == seen[0]["part"].id


def test_velocity_is_what_it_is() -> None:
    for s in seen_carried()[20:30]:
        speed = np.array([130, 55]) / 26 * FPS
        assert np.allclose(s["part"].velocity, speed, atol=12)
        assert 0 < s["part"].velocity_sigma < 10


@pytest.mark.parametrize("name", ["part", "tray"])
def test_what_is_not_there_is_not_seen(name: str) -> None:
    there = {n: p for n, p in START.items() if n != name}
    seen = watch(AppearanceBehaviour(shown(START, "part", "tray")), [there] * 8)
    assert all(name not in s for s in seen)


def test_a_thing_is_found_where_it_was_not_taught() -> None:
    elsewhere = {"tray": (20, 100), "part": (170, 30)}
    seen = watch(AppearanceBehaviour(shown(START, "part", "tray")), [elsewhere] * 3)
    assert all(iou(seen[-1][n], elsewhere, n) > 0.7 for n in elsewhere)


def test_a_covered_thing_is_not_seen_and_is_itself_when_uncovered() -> None:
    covered = {"part": (40, 60), "tray": (25, 50)}
    course = [{"part": (40, 60)}] * 8 + [covered] * 12 + [{"part": (40, 60)}] * 4
    seen = watch(AppearanceBehaviour(shown(START, "part")), course)
    assert "part" not in seen[18]
    assert seen[-1]["part"].id == seen[0]["part"].id


def test_a_saved_state_goes_on_as_the_original_does() -> None:
    views = shown(START, "part", "tray")
    first, second = AppearanceBehaviour(views), AppearanceBehaviour(views)
    course = carried(12)
    for n, places in enumerate(course):
        if n == 15:
            second.load(load_state(dump_state(first.save())))
        here = look(first, n, places)
        if n >= 15:
            there = look(second, n, places)
            assert here.keys() == there.keys()
            for name, region in here.items():
                assert region.bbox == there[name].bbox
                assert np.array_equal(region.mask, there[name].mask)
                assert region.velocity == there[name].velocity


def test_nothing_is_told_of_a_frame_that_cannot_be_trusted() -> None:
    behaviour = AppearanceBehaviour(shown(START, "part"))
    look(behaviour, 0, START)
    assert look(behaviour, 1, START, Health(HealthStatus.BLOCKED, "covered")) == {}
    assert "part" in look(behaviour, 2, START, Health(HealthStatus.OK))
