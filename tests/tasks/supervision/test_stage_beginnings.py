"""When a stage is reported to have begun: once something of it is observed, and not before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from tests.tasks.scripted import ARM, IDENTITIES, INTRUDER, SATELLITE, RelationSpan, Script, watch
from tests.tasks.supervision.drawn import Box, Mask, drawn, first, watched
from visup.agent import Observation, Region
from visup.tasks.supervision import stage_beginnings

APPROACH = "<t> ::= converging(arm, satellite)"
THREE = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (0.0, 1e9)}


def begun(script: Script, text: str, until: float = 14.0) -> dict[str, float]:
    events = watch(script, until, text).events
    return {str(e.data["stage"]): e.time for e in events if e.kind == "stage_started"}


def test_objects_at_rest_begin_no_stage() -> None:
    assert begun(Script(), APPROACH) == {}


@pytest.mark.parametrize("since", [2.0, 5.5])
def test_an_approach_begins_when_the_objects_converge(since: float) -> None:
    script = Script((RelationSpan("converging", since, 12.0),))
    assert begun(script, APPROACH)["t"] == pytest.approx(since, abs=0.3)


def test_an_actor_that_enters_later_begins_the_task() -> None:
    objects = {ARM: (0.0, 1e9), SATELLITE: (3.0, 1e9)}
    assert begun(Script(objects=objects), APPROACH)["t"] == pytest.approx(3.0, abs=0.11)


@pytest.mark.parametrize(
    ("velocity", "comes"),
    [((0.0, 0.0), False), ((5.0, 0.0), False), ((40.0, 0.0), True), (None, True)],
)
def test_an_actor_that_is_found_late_begins_the_task_unless_it_is_found_at_rest(
    velocity: tuple[float, float] | None, comes: bool
) -> None:
    """Where no image motion is measured, it may have come in."""

    def at(i: int) -> Observation:
        regions = [box_region(ARM, (100, 100, 60, 60))]
        regions += [box_region(SATELLITE, (300, 100, 60, 60))] if i >= LATE else []
        measured = () if velocity is None else (velocity, 1.0)
        return seen(i, [_measured(r, *measured) for r in regions if r is not None])

    mind = reason(at(i) for i in range(LATE + 12))[-1].mind
    assert stage_beginnings._newcomers(mind) == (frozenset({SATELLITE}) if comes else frozenset())


LATE = 20


def _measured(
    region: Region, velocity: tuple[float, float] = (0.0, 0.0), sigma: float = 0.0
) -> Region:
    return replace(region, velocity=velocity, velocity_sigma=sigma)


def carried(*spans: RelationSpan) -> Script:
    hold_spans = RelationSpan("touching", 2.0, 20.0), RelationSpan("coupled", 2.5, 20.0)
    return Script(
        (RelationSpan("converging", 0.5, 2.0), *hold_spans, *spans), THREE, identities=IDENTITIES
    )


CARRY = """
actor dish is dish
<t>     ::= <reach> <grasp> <carry>
<reach> ::= converging(arm, satellite)
<grasp> ::= coupled(arm, satellite)
<carry> ::= moving_together(arm, satellite) & converging(satellite, dish)
"""


def test_a_stage_of_two_actions_begins_with_the_first_of_them() -> None:
    nears = RelationSpan("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = carried(RelationSpan("moving_together", 5.0, 12.0), nears)
    assert begun(script, CARRY)["carry"] == pytest.approx(5.0, abs=0.4)


def test_an_action_of_the_previous_stage_does_not_begin_the_next() -> None:
    text = CARRY.replace("coupled(arm, satellite)", "moving_together(arm, satellite)")
    nears = RelationSpan("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = carried(RelationSpan("moving_together", 3.0, 12.0), nears)
    assert begun(script, text)["carry"] == pytest.approx(8.0, abs=0.4)


OFFER = """
actor dish is dish
<t> ::= coupled(arm, satellite) & converging(dish, satellite)
"""


@pytest.mark.parametrize("since", [3.0, 6.0])
def test_a_first_stage_begins_with_an_action_that_did_not_hold_initially(
    since: float,
) -> None:
    """A giver holds its payload all the time: an offer begins when the receiver comes."""
    hold_spans = RelationSpan("touching", 0.0, 20.0), RelationSpan("coupled", 0.5, 20.0)
    nears = RelationSpan("converging", since, 12.0, (SATELLITE, INTRUDER))
    script = Script((*hold_spans, nears), THREE, identities=IDENTITIES)
    assert begun(script, OFFER)["t"] == pytest.approx(since, abs=0.4)


def test_a_first_stage_of_two_actions_begins_with_either() -> None:
    meets = RelationSpan("touching", 3.0, 20.0), RelationSpan("coupled", 3.5, 20.0)
    nears = RelationSpan("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = Script((*meets, nears), THREE, identities=IDENTITIES)
    assert begun(script, OFFER)["t"] == pytest.approx(3.0, abs=0.4)


@pytest.mark.parametrize(
    ("movers", "at"), [((ARM, SATELLITE), None), ((INTRUDER,), 8.0), ((ARM, INTRUDER), 0.1)]
)
def test_a_first_stage_begins_when_all_approaching_actors_move(
    monkeypatch: pytest.MonkeyPatch, movers: tuple[int, ...], at: float | None
) -> None:
    """The giver brings its payload; the offer begins when the receiver, who is named first, sets out, too.

    A payload that is brought to a receiver at rest comes nearer, but does not begin the offer.
    """
    monkeypatch.setattr(stage_beginnings, "moving_bodies", lambda mind: frozenset(movers))
    nears = RelationSpan("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = Script((nears,), THREE, identities=IDENTITIES)
    began = begun(script, OFFER).get("t")
    assert began is at if at is None else began == pytest.approx(at, abs=0.4)


def test_what_another_actor_does_begins_a_first_stage_though_the_lead_of_its_trend_rests(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The giver takes the payload, which moves; the receiver, who is named first, still rests."""
    monkeypatch.setattr(stage_beginnings, "moving_bodies", lambda mind: frozenset((ARM, SATELLITE)))
    meets = RelationSpan("touching", 3.0, 20.0), RelationSpan("coupled", 3.5, 20.0)
    nears = RelationSpan("converging", 8.0, 12.0, (SATELLITE, INTRUDER))
    script = Script((*meets, nears), THREE, identities=IDENTITIES)
    assert begun(script, OFFER)["t"] == pytest.approx(3.0, abs=0.4)


def dated(script: Script, text: str, until: float = 14.0) -> dict[str, tuple[float, float]]:
    """Stage -> when its beginning was reported, and when it is said to have begun."""
    events = watch(script, until, text).events
    reported = (e for e in events if e.kind == "stage_started")
    return {str(e.data["stage"]): (e.time, float(e.data["began"])) for e in reported}


RETREAT = """
<t>    ::= <near> <hold> <away>
<near> ::= converging(arm, satellite)
<hold> ::= touching(arm, satellite)
<away> ::= diverging(arm, satellite)
"""


def retreat(leaves: float) -> Script:
    near, hold = RelationSpan("converging", 0.5, 2.0), RelationSpan("touching", 2.0, leaves)
    return Script((near, hold, RelationSpan("diverging", leaves, 12.0)))


@pytest.mark.parametrize("leaves", [4.0, 6.5])
def test_a_retreat_is_dated_to_its_onset(leaves: float) -> None:
    reported, began = dated(retreat(leaves), RETREAT)["away"]
    assert reported >= began == pytest.approx(leaves, abs=0.11)


def test_a_contact_is_not_dated_back() -> None:
    reported, began = dated(retreat(6.0), RETREAT)["hold"]
    assert reported == began == pytest.approx(2.2, abs=0.11)


def test_no_stage_is_dated_before_the_one_before_it_or_after_its_report() -> None:
    begins = list(dated(retreat(2.3), RETREAT).values())
    assert all(began <= reported for reported, began in begins)
    assert [b for _, b in begins] == sorted(b for _, b in begins)


def test_a_continuing_action_is_dated_to_the_end_of_the_previous_stage() -> None:
    text = RETREAT.replace("touching(arm, satellite)", "keeping_distance(arm, satellite) for 3 s")
    keeps, drifts = RelationSpan("keeping_distance", 2.0, 9.0), RelationSpan("diverging", 3.0, 12.0)
    script = Script((RelationSpan("converging", 0.5, 2.0), keeps, drifts))
    reported, began = dated(script, text)["away"]
    assert 5.0 - 0.11 <= began <= reported


HAUL = """
<fetch>    ::= <approach> <coupling> <haul>
<approach> ::= converging(tug, cart)
<coupling> ::= touching(tug, cart)
<haul>     ::= moving_together(tug, cart) & moving(cart)
"""
ARRIVES_S, LEAVES_S, TUG, CART = 3.0, 5.0, 1, 2


def fetching(now: float, back: float, leaves_s: float = LEAVES_S) -> Mask:
    """A tug that drives to a cart, stands there, and leaves without it at a speed."""
    x = 20.0 + 60.0 * min(now, ARRIVES_S) - back * max(0.0, now - leaves_s)
    return drawn({CART: (260, 100, 60, 50), TUG: (x, 100, 60, 50)})


def haul(folder: Path, mask: Callable[[float], Mask], until: float) -> float | None:
    """When the haul is reported to begin, after the coupling."""
    events = watched(folder, HAUL, mask, {"tug": TUG, "cart": CART}, until)
    assert first(events, "stage_started", "coupling") is not None
    return first(events, "stage_started", "haul")


def test_a_stage_begins_when_an_actor_that_has_rested_sets_out(tmp_path: Path) -> None:
    leaves = partial(fetching, back=40.0)
    assert haul(tmp_path, leaves, LEAVES_S + 1.0) == pytest.approx(LEAVES_S + 0.3, abs=0.3)


@pytest.mark.parametrize("back", [0.0, 4.0])
def test_actors_that_rest_or_only_shift_begin_no_stage(tmp_path: Path, back: float) -> None:
    assert haul(tmp_path, partial(fetching, back=back), LEAVES_S + 1.0) is None


def test_an_actor_that_has_not_rested_begins_no_stage(tmp_path: Path) -> None:
    """What turns back at once may only have come into contact."""
    turns = partial(fetching, back=40.0, leaves_s=ARRIVES_S + 0.4)
    assert haul(tmp_path, turns, ARRIVES_S + 0.9) is None


def test_a_gripper_that_leaves_alone_has_not_begun_to_take_anything_along(tmp_path: Path) -> None:
    text = HAUL.replace("<coupling> ::= touching", "<coupling> ::= coupled")
    mask = partial(fetching, back=40.0)
    events = watched(tmp_path, text, mask, {"tug": TUG, "cart": CART}, LEAVES_S + 3.0)
    assert first(events, "stage_done", "coupling") is not None
    assert first(events, "stage_started", "haul") is None
    assert any(e.kind == "stage_failing" for e in events)


STACK = "<t> ::= converging(block, base)"
BLOCK, BASE, GRIPPER, SHIFTS_S = 1, 2, 3, 1.0


def shifting(now: float, gripper: bool) -> Mask:
    """A block whose outline shifts slowly, beside a gripper that sweeps past it, or alone."""
    shift = 3.0 * max(0.0, now - SHIFTS_S)
    boxes = {BLOCK: (100 + shift, 150, 40, 40), BASE: (280, 150, 30, 40)}
    if gripper:
        boxes[GRIPPER] = (40 + 60.0 * now, 100, 40, 40)
    return drawn(boxes)


@pytest.mark.parametrize("gripper", [False, True])
def test_what_shifts_beside_a_mover_begins_no_stage(tmp_path: Path, gripper: bool) -> None:
    roles = {"block": BLOCK, "base": BASE, "gripper": GRIPPER}
    events = watched(tmp_path, STACK, partial(shifting, gripper=gripper), roles, SHIFTS_S + 0.9)
    assert (first(events, "stage_started", "t") is None) is gripper


ASSEMBLE = """
<t>           ::= <bring_block> <bring_cap>
<bring_block> ::= converging(block, base)
<bring_cap>   ::= converging(cap, base)
"""
CAP, CAP_LEAVES_S = 4, 1.5


def bringing(now: float, mover: int, speed: float) -> Mask:
    """Three bodies at rest, of which one sets out."""
    boxes: dict[int, Box] = {
        BLOCK: (60, 30, 40, 40),
        BASE: (240, 180, 60, 40),
        CAP: (60, 180, 40, 30),
    }
    x, y, width, height = boxes[mover]
    boxes[mover] = (x + speed * max(0.0, now - CAP_LEAVES_S), y, width, height)
    return drawn(boxes)


@pytest.mark.parametrize(("mover", "speed", "begins"), [(CAP, 60, 1), (BLOCK, 60, 1), (CAP, 4, 0)])
def test_a_task_begins_with_the_part_whose_turn_comes_later(
    tmp_path: Path, mover: int, speed: float, begins: int
) -> None:
    roles = {"block": BLOCK, "base": BASE, "cap": CAP}
    mask = partial(bringing, mover=mover, speed=speed)
    events = watched(tmp_path, ASSEMBLE, mask, roles, CAP_LEAVES_S + 0.8)
    at = first(events, "stage_started", "bring_block")
    assert at == (pytest.approx(CAP_LEAVES_S + 0.3, abs=0.3) if begins else None)
    assert first(events, "stage_started", "bring_cap") is None
