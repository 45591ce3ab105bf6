"""Who plays whom by other means than a model: colour, size, order, place, conduct, the machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import pytest

from tests.rules.scenes import SIZE, Rect, box_region, seen
from tests.tasks.scripted import belief
from visup.agent import Binding, Mind, Percept, Report, ReportState, TaskBelief, Verdict
from visup.agent.cycle.answers import resolve_model
from visup.rules.identity.identification import answered_model
from visup.rules.reasoners import default_reasoners
from visup.tasks import parse_task
from visup.tasks.casting.matching import match
from visup.tasks.supervision.supervise import task_reasoner

LAB = {"red": (52.0, 70.0, 50.0), "blue": (36.0, 20.0, -60.0), "grey": (52.0, 0.0, 0.0)}
Path = Callable[[float], Rect]


def still(*rect: float) -> Path:
    x, y, w, h = rect
    return lambda t: (x, y, w, h)


def going(path: Path, vx: float, vy: float = 0.0, since: float = 0.0) -> Path:
    def at(t: float) -> Rect:
        x, y, w, h = path(t)
        elapsed_s = max(0.0, t - since)
        return x + vx * elapsed_s, y + vy * elapsed_s, w, h

    return at


def bound(
    declared: str,
    paths: Mapping[int, Path],
    colours: Mapping[int, str] | None = None,
    seconds: float = 4.0,
    names: Mapping[int, str] | None = None,
    actors: str = "a",
) -> list[int | None]:
    """Which object plays each of some actors at the end, by the id of its region."""
    return _bound(
        declared, tuple(paths.items()), tuple((colours or {}).items()), seconds,
        tuple((names or {}).items()), actors,
    )  # fmt: skip


@cache
def _bound(
    declared: str,
    paths: tuple[tuple[int, Path], ...],
    colours: tuple[tuple[int, str], ...],
    seconds: float,
    names: tuple[tuple[int, str], ...],
    actors: str,
) -> list[int | None]:
    conditions = " ".join(f"seen({a})" for a in actors.split())
    rules = default_reasoners(traits=True)
    task = task_reasoner([parse_task(f"{declared}\n<t> ::= {conditions}")])
    mind = Mind()
    for i in range(round(seconds * 25)):
        regions = [box_region(n, path(i / 25)) for n, path in paths]
        present = {r.id for r in regions if r is not None}
        visible_names = {n: [(name, 0.9)] for n, name in names if n in present}
        observation = seen(i, regions, names=visible_names)
        colour_percepts = tuple(
            Percept("colour", {"region_id": n, "palette": ((*LAB[c], 0.9),)}, i / 25, "colour")
            for n, c in colours
            if n in present
        )
        report = Report("colour", ReportState.RAN, ("colour",), colour_percepts)
        observation = replace(observation, reports=(*observation.reports, report))
        for reasoner in (*rules.update, *rules.cogitate, task):
            mind = reasoner(mind, observation).mind
    playing = {b.actor: b.object_id for b in mind.tasks[0].bindings}
    regions_of = {i: b.region.id for i, b in mind.objects.items()}
    return [regions_of.get(playing[a] or -1) for a in actors.split()]


LEFT, MIDDLE, RIGHT = still(60, 200, 40, 40), still(300, 180, 60, 60), still(520, 220, 40, 40)
THREE = {1: LEFT, 2: MIDDLE, 3: RIGHT}
COLOURED = {1: "red", 2: "blue", 3: "red"}


@pytest.mark.parametrize(
    ("declared", "expected"),
    [
        ("actor a is blue", [2]),
        ("actor a is green", [None]),
        ("actor a is green or blue", [2]),
        ("actor a is red and the rightmost", [3]),
        ("actor a is the leftmost red", [1]),
        ("actor a is the leftmost", [1]),
        ("actor a is the largest", [2]),
        ("actor a is larger than 70 px", [2]),
        ("actor a is smaller than 70 px and the rightmost", [3]),
        ("actor a is larger than 200 px", [None]),
        ("actor a at (330, 210)", [2]),
        ("actor a at (535, 240)", [3]),
        ("actor a at (200, 40)", [None]),
        ("actor a is what rests and at (80, 220)", [1]),
    ],
)
def test_unknown_objects_are_matched_by_the_criteria_of_the_task(
    declared: str, expected: list[int | None]
) -> None:
    assert bound(declared, THREE, COLOURED, 3.0) == expected


def test_equal_objects_are_assigned_to_different_actors() -> None:
    two = "actor a is the leftmost red\nactor b is the rightmost red"
    assert bound(two, THREE, COLOURED, 3.0, actors="a b") == [1, 3]
    other = "actor a is red\nactor b is another red"
    first, second = bound(other, THREE, COLOURED, 3.0, actors="a b")
    assert {first, second} == {1, 3}
    assert bound(other, {2: MIDDLE, 3: RIGHT}, COLOURED, 3.0, actors="a b") == [3, None]


def test_the_initial_order_of_objects_is_kept_when_they_move() -> None:
    swapped = {1: going(LEFT, 150.0, 20.0, 2.0), 3: going(RIGHT, -150.0, -40.0, 2.0)}
    two = "actor a is the leftmost red\nactor b is the rightmost red"
    assert bound(two, swapped, COLOURED, 5.0, actors="a b") == [1, 3]


def test_entering_objects_are_matched_by_the_side_they_enter_from() -> None:
    width = SIZE[0]
    paths = {
        1: MIDDLE,
        2: going(still(-60, 300, 50, 50), 60.0, since=2.0),
        3: going(still(width + 10, 80, 50, 50), -60.0, since=2.0),
    }
    for side, expected in (("left", 2), ("right", 3), ("top", None)):
        assert bound(f"actor a is what enters from the {side}", paths, None, 6.0) == [expected]


def test_the_first_object_to_move_is_matched() -> None:
    paths = {1: going(LEFT, 40.0, since=3.0), 2: MIDDLE, 3: going(RIGHT, 0.0, -40.0, 1.5)}
    assert bound("actor a is what moves first", paths, None, 5.0) == [3]


def test_criteria_can_be_combined_with_models() -> None:
    names = {1: "cup", 2: "cup", 3: "mug"}
    assert bound("actor a is cup and red", THREE, COLOURED, 3.0, names) == [1]
    two = "actor a is cup\nactor b is the other cup"
    assert set(bound(two, THREE, COLOURED, 3.0, names, actors="a b")) == {1, 2}


def test_a_part_is_matched_by_its_coupling_to_the_machine() -> None:
    names = {1: "arm", 2: "claw", 3: "claw"}
    comes = going(still(221, 205, 30, 30), -60.0)
    paths = {
        1: still(60, 200, 100, 40),
        2: still(400, 200, 30, 30),
        3: lambda t: comes(min(t, 1.0)),
    }
    declared = "actor a is part of arm and red\nactor arm is arm"
    assert bound(declared, paths, {2: "red", 3: "red"}, 3.0, names, "a arm") == [3, 1]
    assert bound("actor claw is part of arm", paths, None, 3.0, names, "claw arm") == [3, 1]


def test_an_answer_of_the_operator_binds_exactly_that_object() -> None:
    task = parse_task("actor a is red\nactor b is another red\n<t> ::= seen(a) seen(b)")
    mind = Mind(objects={i: belief(i, {}) for i in (1, 2)}, answers={2: "a"})
    assert [b.object_id for b in match(task, mind)] == [2, None]


CAST = {"left": ("leg",), "right": ("leg",), "part": (), "arm": ("rms",)}


@pytest.mark.parametrize(
    ("name", "model"), [("left", "left"), ("Part", "part"), ("arm", "rms"), ("rms", "rms")]
)
def test_an_actor_as_an_answer_stands_for_its_model_if_unambiguous(name: str, model: str) -> None:
    assert resolve_model(Mind(), name, ("rms", "leg"), cast=CAST) == model


def test_an_object_answered_as_an_actor_is_believed_to_be_its_model() -> None:
    belief_of = TaskBelief("t", Verdict.UNKNOWN, bindings=(Binding("left", ("leg",)),))
    mind = Mind(tasks=(belief_of,))
    assert answered_model(mind, "left") == "leg"
    assert answered_model(mind, "rms") == "rms"
