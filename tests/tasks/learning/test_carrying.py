"""What is learned of carrying, of where things end up, and of who comes to rest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from tests.tasks.scripted import RelationSpan, Script, play
from visup.agent import Mind, Outcome, Region, Verdict
from visup.tasks.analysis.judging import judged
from visup.tasks.checks.load import parse_task
from visup.tasks.learning.carrying import with_carrying
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.meetings import meetings_of, pairs_by_weight
from visup.tasks.learning.order import CarryingStage
from visup.tasks.learning.places import MAX_SHARED, FinalPlace, places_of
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.rests import final_rest_of
from visup.tasks.learning.traces import ActionInterval, RunTrace, Span, trace_of
from visup.testing import region_of

GRIPPER, PART, FIXTURE = 1, 2, 3
NAMES = {GRIPPER: {"gripper": 0.9}, PART: {"part": 0.9}, FIXTURE: {"fixture": 0.9}}
HELD, PLACED = ("gripper", "part"), ("fixture", "part")


def event(action: str, pair: tuple[str, ...], begin: float, end: float = 20.0) -> CourseEvent:
    return CourseEvent(ActionInterval((action, pair), begin, end), begin, end >= 20.0)


def pick_and_place_events(met: float = 8.0) -> list[CourseEvent]:
    """The gripper takes the part and puts it on the fixture."""
    return [
        event("converging", HELD, 1.0, 3.0),
        event("coupled", HELD, 3.0, 10.0),
        event("touching", PLACED, met),
        event("decoupled", HELD, 10.0),
    ]


def trace(moves: Mapping[str, tuple[Span, ...]], *intervals: ActionInterval) -> RunTrace:
    return RunTrace("run", intervals, 0.0, 20.0, moves=moves, diagonal=600.0)


BRINGS: Mapping[str, tuple[Span, ...]] = {"gripper": ((1.0, 8.0),), "part": ((3.5, 8.0),)}
APPROACHES = ActionInterval(("converging", PLACED), 4.0, 8.0)
RETREATS = ActionInterval(("diverging", HELD), 10.0, 14.0)


def carrying_stages(rows: Sequence[Sequence[CourseEvent]]) -> list[CarryingStage]:
    return [e.item for row in rows for e in row if isinstance(e.item, CarryingStage)]


def test_a_coupled_actor_that_moves_along_is_carried_to_the_next_contact() -> None:
    rows = with_carrying(
        [pick_and_place_events(), pick_and_place_events(7.5)],
        [trace(BRINGS, APPROACHES, RETREATS)] * 2,
    )
    expected = CarryingStage((("moving_together", HELD), ("converging", PLACED)))
    assert carrying_stages(rows) == [expected, expected]
    assert [e.symbol[0] for e in rows[0]] == [
        *("converging", "coupled", "moving_together", "touching", "decoupled", "diverging")
    ]


def test_carrying_is_learned_only_if_all_runs_show_it() -> None:
    still = trace({"gripper": ((1.0, 3.0),)}, APPROACHES, RETREATS)
    assert not carrying_stages(
        with_carrying(
            [pick_and_place_events(), pick_and_place_events()], [trace(BRINGS, APPROACHES), still]
        )
    )
    nowhere = [row[:2] for row in (pick_and_place_events(), pick_and_place_events())]
    (first, _) = carrying_stages(with_carrying(nowhere, [trace(BRINGS)] * 2))
    assert first.parts == (("moving_together", HELD), ("moving", ("part",)))  # the gripper came


def test_no_carrying_to_an_actor_that_comes_by_itself_or_while_another_holds_the_part() -> None:
    comes = trace({**BRINGS, "fixture": ((3.0, 8.0),)}, APPROACHES)
    assert not carrying_stages(with_carrying([pick_and_place_events()], [comes]))
    held = [event("coupled", ("arm", "part"), 0.0, 15.0), *pick_and_place_events()[1:2]]
    assert HELD not in [
        c.parts[0][1] for c in carrying_stages(with_carrying([held], [trace(BRINGS)]))
    ]


def test_apparent_motion_by_a_swaying_camera_is_not_coming_by_itself() -> None:
    swayed = trace({**BRINGS, "fixture": ((3.0, 8.0),)}, APPROACHES)
    assert carrying_stages(
        with_carrying([pick_and_place_events()], [replace(swayed, fastest={"fixture": 4.0})])
    )
    assert not carrying_stages(
        with_carrying([pick_and_place_events()], [replace(swayed, fastest={"fixture": 90.0})])
    )


@pytest.mark.parametrize(("until", "counted"), [(12.5, False), (15.0, True)])
def test_contacts_of_the_carrier_before_its_retreat_are_not_meetings(
    until: float, counted: bool
) -> None:
    """It lets go at 10 s; before the part, in the image, it is until 12 s."""
    beyond = ("fixture", "gripper")
    seen = trace(
        BRINGS,
        ActionInterval(("touching", HELD), 2.5, 12.0),
        ActionInterval(("coupled", HELD), 3.0, 10.0),
        ActionInterval(("touching", beyond), 7.0, until),
        ActionInterval(("touching", PLACED), 8.0, 20.0),
    )
    (meetings,) = meetings_of([seen], pairs_by_weight([seen]))
    assert {m.pair for m in meetings} == {HELD, PLACED} | ({beyond} if counted else set())


def placed_run(name: str, share: float, down: int = 0, bobs: float = 0.0) -> RunTrace:
    """A part comes to the fixture, meets it after 6 s and lies with a share of its width over it.

    `down` is how far below the fixture's upper edge its own one is, pixels, and `bobs` by how much the share
    changes, up and down."""
    spans = [
        RelationSpan("converging", 2.0, 6.2, (PART, FIXTURE)),
        RelationSpan("touching", 6.0, 1e9, (PART, FIXTURE)),
    ]
    share_at = lambda t: share + bobs * np.sin(2 * np.pi * t / 2.4)  # noqa: E731
    return played_run(name, spans, share_at, down)


def played_run(
    name: str, spans: Sequence[RelationSpan], share: Callable[[float], float], down: int = 0
) -> RunTrace:
    """A run of 12 s in which a part lies over a fixture with a share of its width."""

    def regions(time: float) -> dict[int, Region]:
        left = 160 - round(40 * share(time))
        boxes = {
            GRIPPER: (400, 100, 40, 40),
            FIXTURE: (100, 100, 60, 60),
            PART: (left, 100 + down, 40, 40),
        }
        return {
            n: region_of(np.ones((h, w), dtype=bool), n, at=(x, y), size=(640, 480))
            for n, (x, y, w, h) in boxes.items()
        }

    there = {n for s in spans for n in s.objects}
    script = Script(tuple(spans), objects=dict.fromkeys(there, (0.0, 1e9)), identities=NAMES)
    minds: list[Mind] = []

    def keep(mind: Mind, observation: object) -> Outcome:
        shapes = regions(mind.time)
        objects = {
            n: replace(o, region=shapes[n], last_seen=mind.time) for n, o in mind.objects.items()
        }
        minds.append(replace(mind, objects=objects))
        return Outcome(mind)

    play(keep, script, 12.0, fps=5.0)
    return trace_of(name, minds)


def release_run(
    name: str,
    share: float = 0.9,
    leaves: Span = (9.4, 11.0),
    free: float = 9.0,
    apart: float = 9.2,
) -> RunTrace:
    """A gripper takes a part, puts it on the fixture and lets it go, which is told at `free`."""
    spans = [
        RelationSpan("converging", 0.5, 2.8, (GRIPPER, PART)),
        RelationSpan("touching", 2.6, apart, (GRIPPER, PART)),
        RelationSpan("coupled", 3.0, free, (GRIPPER, PART)),
        RelationSpan("moving_together", 3.2, 6.2, (GRIPPER, PART)),
        RelationSpan("converging", 4.0, 6.2, (PART, FIXTURE)),
        RelationSpan("touching", 6.0, 1e9, (PART, FIXTURE)),
        RelationSpan("diverging", *leaves, (GRIPPER, PART)),
    ]
    carried = dict.fromkeys(HELD, ((3.2, 6.2),))
    return replace(played_run(name, spans, lambda t: share), moves=carried)


def test_the_retreat_after_a_release_is_optional_if_the_part_is_in_place() -> None:
    learned = learn_task(
        "put", [release_run(f"good{k}", share) for k, share in enumerate((0.8, 0.9, 1.0))]
    )
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}
    assert "<retreat>? <stay>" in learned.text
    assert "<stay> ::= already shared_outline(fixture, part) > " in learned.text
    task = parse_task(learned.text)
    late = release_run("late", leaves=(8.0, 9.0), free=11.0, apart=1e9)
    back = release_run("back", leaves=(9.0, 9.6))
    never_told = release_run("never told", free=1e9)
    for trace in (release_run("seen"), late, back, never_told):
        assert judged(task, trace.minds).verdict is Verdict.SUCCEEDED, trace.name
    for trace in (release_run("beside", 0.05), release_run("held", free=1e9, apart=1e9)):
        assert judged(task, trace.minds).verdict is not Verdict.SUCCEEDED, trace.name


def test_the_shared_outline_of_a_bobbing_part_is_its_median() -> None:
    contact = ("touching", PLACED)
    rows = [[event("touching", PLACED, 6.0)]]
    still, bobbing = (
        next(places_of((contact, 0), rows, [placed_run("a", 0.5, bobs=b)], [])) for b in (0.0, 0.4)
    )
    assert bobbing.seen == pytest.approx(still.seen, abs=0.06)


def test_a_part_beside_its_place_is_refused_though_it_touches_it() -> None:
    learned = learn_task(
        "put", [placed_run(f"good{k}", share) for k, share in enumerate((0.9, 1.0, 0.8))]
    )
    assert "shared_outline(fixture, part) > " in learned.text
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}
    task = parse_task(learned.text)
    assert judged(task, placed_run("near", 0.75).minds).verdict is Verdict.SUCCEEDED
    assert judged(task, placed_run("beside", 0.05).minds).verdict is not Verdict.SUCCEEDED


def test_outlines_that_barely_touch_yield_no_final_place() -> None:
    rows = [[event("touching", PLACED, 6.0)]]
    for apart in (
        placed_run("a", -0.1),
        placed_run("a", 0.05, down=58),
    ):  # a gap; corners that meet
        assert not list(places_of((("touching", PLACED), 0), rows, [apart], []))
    (place,) = places_of((("touching", PLACED), 0), rows, [placed_run("a", 0.5)], [])
    assert isinstance(place, FinalPlace)
    # Half of its upper and lower side, one of which lies along that of the fixture, and a side.
    assert place.seen == pytest.approx(80 / 160, abs=0.05)


def test_the_required_share_is_capped() -> None:
    contact = ("touching", PLACED)
    within, beside = (FinalPlace(contact, (contact, 0), s) for s in (1.0, MAX_SHARED))
    assert within.least == beside.least == 42


def test_no_final_rest_in_a_stage_without_contact() -> None:
    assert final_rest_of([placed_run("a", 0.5)], (("diverging", PLACED), 0)) is None
