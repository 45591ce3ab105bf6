"""Every construct of the language does at run time what the page says of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from tests.tasks.scripted import (
    ARM,
    INTRUDER,
    REGION,
    SATELLITE,
    RelationSpan,
    Script,
    ScriptedRun,
    play,
)
from visup.agent import Mind, Observation, Outcome, Status, TaskBelief, Verdict, Zone
from visup.agent.model.errors import TaskError
from visup.rules.relations.zones import ZoneReasoner
from visup.tasks import load_task, load_tasks, parse_task
from visup.tasks.actions.actions import ActionDefinition, known_actions, with_actions
from visup.tasks.supervision.supervise import finish, task_reasoner

NEARS = RelationSpan("converging", 0.5, 6.0)
MEETS = RelationSpan("touching", 5.8, 30.0)
HOLDS = RelationSpan("coupled", 8.0, 30.0)
BOOM = {ARM: (0.0, 1e9), SATELLITE: (0.0, 1e9), INTRUDER: (0.0, 1e9)}
ACTORS = "actor boom is dish\n"


def watch(text: str, script: Script, until: float = 20.0) -> ScriptedRun:
    return play(task_reasoner([parse_task(text)]), script, until)


def belief(played: ScriptedRun, time: float | None = None) -> TaskBelief:
    return (played.last if time is None else played.at(time)).tasks[0]


def status(played: ScriptedRun, stage: str, time: float | None = None) -> Status:
    return next(s.status for s in belief(played, time).stages if s.stage == stage)


def first(played: ScriptedRun, kind: str, stage: str) -> float:
    return next(e.time for e in played.events if e.kind == kind and e.data.get("stage") == stage)


def test_an_end_condition_ends_its_stage() -> None:
    text = (
        "<t> ::= <near> <far>\n"
        "<near> ::= converging(arm, satellite){}\n"
        "<far> ::= diverging(arm, satellite)"
    )
    script = Script((RelationSpan("converging", 0.5, 9.0), RelationSpan("touching", 4.0, 9.0)))
    assert status(watch(text.format(""), script, 8.0), "near") is Status.PROGRESSING
    ended = watch(text.format(" ends when touching(arm, satellite) for 1 s"), script, 8.0)
    assert status(ended, "near") is Status.DONE
    assert first(ended, "stage_done", "near") == pytest.approx(5.0, abs=0.3)


def test_a_stage_that_is_left_before_its_end_condition_has_failed() -> None:
    text = (
        "<t> ::= <near> <caught>\n"
        "<near> ::= converging(arm, satellite) ends when gone(arm)\n"
        "<caught> ::= coupled(arm, satellite)"
    )
    played = watch(text, Script((NEARS, HOLDS)), 20.0)
    assert status(played, "near") is Status.FAILED
    assert "ends when gone(arm)" in str([e.text for e in played.events])


def test_a_stage_does_not_begin_before_its_begin_condition() -> None:
    text = (
        "<t> ::= <near> <caught>\n"
        "<near> ::= converging(arm, satellite)\n"
        "<caught> ::= coupled(arm, satellite){}"
    )
    script = Script((NEARS, MEETS, HOLDS))
    usual = watch(text.format(""), script, 12.0)
    late = watch(text.format(" begins when coupled(arm, satellite) for 1 s"), script, 12.0)
    assert first(usual, "stage_started", "caught") < 7.0
    assert first(late, "stage_started", "caught") >= 9.0
    assert status(late, "caught") in (Status.PROGRESSING, Status.DONE)


def test_evidence_before_a_first_stage_begins_is_ignored() -> None:
    text = "<t> ::= converging(arm, satellite) begins when touching(arm, satellite)"
    script = Script((RelationSpan("diverging", 0.0, 9.0), RelationSpan("touching", 12.0, 30.0)))
    assert status(watch(text, script, 11.0), "t") is Status.ACTIVE
    assert (
        status(watch("<t> ::= converging(arm, satellite)", script, 11.0), "t") is not Status.ACTIVE
    )


def test_a_fails_when_condition_replaces_the_default_failure() -> None:
    text = "<t> ::= converging(arm, satellite) fails when touching(arm, satellite) for 1 s"
    parting = Script((RelationSpan("diverging", 1.0, 30.0),))
    assert status(watch(text, parting, 10.0), "t") not in (Status.FAILING, Status.FAILED)
    # It counts although the action holds.
    script = Script((RelationSpan("converging", 0.5, 30.0), RelationSpan("touching", 5.0, 30.0)))
    played = watch(text, script, 8.0)
    assert status(played, "t") is Status.FAILING
    assert 5.9 <= first(played, "stage_failing", "t") <= 6.8


def test_a_progress_condition_replaces_the_default_progress() -> None:
    text = "<t> ::= coupled(arm, satellite){}"
    script = Script((RelationSpan("converging", 0.5, 30.0),))
    assert status(watch(text.format(""), script, 10.0), "t") is Status.PROGRESSING
    strict = watch(text.format(" progresses when touching(arm, satellite)"), script, 10.0)
    assert status(strict, "t") is Status.ACTIVE


@pytest.mark.parametrize(
    ("condition", "true"),
    [
        ("touching(arm, satellite)", True),
        ("not touching(arm, satellite)", False),
        ("touching(arm, satellite) and coupled(arm, satellite)", False),
        ("touching(arm, satellite) or coupled(arm, satellite)", True),
        ("not (coupled(arm, satellite) or not touching(arm, satellite))", True),
    ],
)
def test_boolean_conditions_are_evaluated_as_written(condition: str, true: bool) -> None:
    text = f"<t> ::= keeping_distance(arm, satellite)\nnever {condition}"
    script = Script(
        (RelationSpan("keeping_distance", 0.0, 30.0), RelationSpan("touching", 0.0, 30.0))
    )
    broken = belief(watch(text, script, 5.0)).verdict is Verdict.INTERRUPTED
    assert broken is true


def test_a_broken_invariant_about_one_object_fails_the_task_without_alarm() -> None:
    text = "<t> ::= <near>\n<near> ::= keeping_distance(arm, satellite) for 9 s\nnever present(satellite)"
    script = Script((RelationSpan("keeping_distance", 0.0, 30.0),))
    played = watch(text, script, 5.0)
    assert belief(played).verdict is Verdict.FAILED
    assert status(played, "near") is Status.FAILED


def test_an_unobservable_condition_breaks_no_invariant() -> None:
    text = "<t> ::= keeping_distance(arm, satellite)\nnever not moving(boom)"
    script = Script((RelationSpan("keeping_distance", 0.0, 30.0),))
    assert belief(watch(ACTORS + text, script, 5.0)).verdict is Verdict.SUCCEEDED


def test_an_invariant_has_a_duration_and_applies_only_during_its_stages() -> None:
    text = (
        "<t> ::= <first> <second>\n"
        "<first> ::= <near>\n"
        "<near> ::= converging(arm, satellite)\n"
        "<second> ::= coupled(arm, satellite)\n"
        "never touching(arm, satellite){}"
    )
    script = Script((NEARS, MEETS, HOLDS))
    soon = watch(text.format(""), script, 15.0)
    late = watch(text.format(" for 5 s"), script, 15.0)
    kind = "invariant_broken"
    assert next(e.time for e in soon.events if e.kind == kind) == pytest.approx(6.3, abs=0.2)
    assert next(e.time for e in late.events if e.kind == kind) == pytest.approx(10.8, abs=0.2)
    # The stage that groups counts for those inside it.
    early = Script((RelationSpan("converging", 0.5, 9.0), RelationSpan("touching", 3.0, 4.5)))
    text = text.replace("coupled", "diverging")
    during = watch(text.format(" during <first>"), early, 8.0)
    assert kind in [e.kind for e in during.events]
    assert kind not in [e.kind for e in watch(text.format(" during <second>"), early, 8.0).events]


def test_repetitions_are_counted() -> None:
    text = "<t> ::= <go> {}\n<go> ::= converging(arm, satellite) for 1 s diverging(arm, satellite) for 1 s"
    twice = Script(
        tuple(RelationSpan("converging", t, t + 2.0) for t in (0.5, 4.5))
        + tuple(RelationSpan("diverging", t, t + 2.0) for t in (2.5, 6.5))
    )
    assert belief(watch(text.format("at least 2 times at most 2 times"), twice, 9.0)).verdict is (
        Verdict.SUCCEEDED
    )
    assert belief(watch(text.format("at least 3 times"), twice, 9.0)).verdict is Verdict.IN_PROGRESS


@pytest.mark.parametrize("order", [("touching", "converging"), ("converging", "touching")])
def test_any_order_accepts_every_order_and_requires_each_stage(order: tuple[str, str]) -> None:
    text = (
        "<t> ::= any order (<touch>, <near>) <caught>\n<touch> ::= touching(arm, satellite) for 1 s\n"
        "<near> ::= converging(arm, satellite) for 1 s\n<caught> ::= coupled(arm, satellite)"
    )
    script = Script(
        (
            RelationSpan(order[0], 1.0, 4.0),
            RelationSpan(order[1], 4.0, 7.0),
            RelationSpan("coupled", 7, 30),
        )
    )
    played = watch(text, script, 15.0)
    assert belief(played).verdict is Verdict.SUCCEEDED
    assert {status(played, s) for s in ("touch", "near")} == {Status.DONE}
    only = Script((RelationSpan("touching", 1.0, 7.0), RelationSpan("coupled", 7.0, 30.0)))
    assert belief(watch(text, only, 15.0)).verdict is not Verdict.SUCCEEDED


def test_stages_of_an_optional_actor_may_be_skipped() -> None:
    text = "<t> ::= <seen> <caught>\n<seen> ::= touching(arm, boom)\n<caught> ::= coupled(arm, satellite)"
    script = Script((MEETS, HOLDS))
    must = watch("actor boom is dish\n" + text, script, 15.0)
    may = watch("optional actor boom is dish\n" + text, script, 15.0)
    assert belief(must).verdict is not Verdict.SUCCEEDED
    assert belief(may).verdict is Verdict.SUCCEEDED
    # Nobody waits for it: an object that no actor explains is told at once.
    later = {**BOOM, INTRUDER: (2.0, 1e9)}  # what is there from the start is scenery
    crowded = replace(
        script, objects=later, identities={ARM: {"arm": 1.0}, SATELLITE: {"satellite": 1.0}}
    )
    text = "<t> ::= coupled(arm, satellite) & present(boom)"
    assert belief(watch("optional actor boom is dish\n" + text, crowded, 3.0)).unexplained == (
        INTRUDER,
    )
    assert belief(watch("actor boom is dish\n" + text, crowded, 3.0)).unexplained == ()


def watch_path(
    played_until: float, path: dict[float, tuple[float, float]], text: str, **mind: object
) -> Mind:
    """A task watched while the arm's centre and outline are where a path says, by time."""
    reasoner = task_reasoner([parse_task(text)])

    def think(before: Mind, observation: Observation) -> Outcome:
        x, y = next(p for t, p in sorted(path.items(), reverse=True) if t <= before.time)
        square = np.array([[x, y], [x + 4, y], [x + 4, y + 4], [x, y + 4]], dtype=np.float32)
        region = replace(
            REGION,
            centroid=(x + 2, y + 2),
            contour=square,
            bbox=(int(x), int(y), 4, 4),
            mask=np.ones((4, 4), dtype=bool),
        )
        arm = replace(before.objects[ARM], region=region)
        objects = MappingProxyType({**before.objects, ARM: arm})
        now = replace(before, objects=objects, **mind)  # type: ignore[arg-type]
        return reasoner(ZoneReasoner()(now, observation).mind, observation)

    return play(think, Script(), played_until).last


CORNERS = "zone berth is (100, 100) (200, 100) (200, 200) (100, 200)\n"


@pytest.mark.parametrize("declared", [CORNERS, "zone berth\n"])
def test_a_zone_is_entered_and_left(declared: str) -> None:
    text = (
        declared + "<t> ::= <in> <out>\n<in> ::= inside(arm, berth)\n<out> ::= outside(arm, berth)"
    )
    drawn = Zone("berth", ((100, 100), (200, 100), (200, 200), (100, 200)))
    path = {0.0: (20.0, 150.0), 3.0: (150.0, 150.0)}
    inside = watch_path(6.0, path, text, zones=(drawn,)).tasks[0]
    assert inside.stages[0].status is Status.DONE
    outside = watch_path(9.0, {**path, 6.0: (198.5, 300.0)}, text, zones=(drawn,)).tasks[0]
    assert outside.verdict is Verdict.SUCCEEDED
    halfway = watch_path(9.0, {**path, 6.0: (198.5, 150.0)}, text, zones=(drawn,)).tasks[0]
    assert halfway.verdict is Verdict.IN_PROGRESS
    never = watch_path(6.0, {0.0: (20.0, 150.0)}, text, zones=(drawn,)).tasks[0]
    assert never.verdict is not Verdict.SUCCEEDED


def test_predicates_and_quantities_of_rules_are_actions() -> None:
    actions = known_actions()
    assert {"moving", "hidden", "gap", "time_to_contact", "disconnected"} <= set(actions)
    assert not {"expected", "stale", "healthy", "actor"} & set(actions)
    final = belief(
        watch("<t> ::= seen(arm) for 2 s hidden(arm)", Script(hidden={ARM: (4.0, 30.0)}), 8.0)
    )
    assert final.verdict is Verdict.SUCCEEDED
    text = "parameter age is {}\n<t> ::= in_view(arm) > age"
    assert belief(watch(text.format("3 s"), Script(), 2.0)).verdict is not Verdict.SUCCEEDED
    played = watch(text.format("3 s"), Script(), 5.0)
    assert belief(played).verdict is Verdict.SUCCEEDED
    assert "at a in view above 3 s" in str([e.text for e in played.events])
    assert belief(watch(text.format("1 min"), Script(), 5.0)).verdict is not Verdict.SUCCEEDED


def test_a_parameter_stands_for_its_amount() -> None:
    text = "parameter patience is 4 s\n<t> ::= converging(arm, satellite) for patience"
    assert (
        belief(watch(text, Script((RelationSpan("converging", 0, 30),)), 3.5)).verdict
        is Verdict.IN_PROGRESS
    )
    assert (
        belief(watch(text, Script((RelationSpan("converging", 0, 30),)), 4.6)).verdict
        is Verdict.SUCCEEDED
    )


def test_plug_ins_add_actions() -> None:
    gripped = ActionDefinition("gripped", holds=("gripped",), arity=2, hold_s=0.5, text="gripped")
    actions = with_actions(known_actions(), [gripped])
    task = parse_task("<t> ::= gripped(arm, satellite)", actions=actions)
    script = Script((RelationSpan("gripped", 2.0, 30.0),), known=["gripped"])
    assert play(task_reasoner([task], actions=actions), script, 4.0).last.tasks[0].verdict is (
        Verdict.SUCCEEDED
    )
    with pytest.raises(TaskError, match="already"):
        with_actions(known_actions(), [replace(gripped, name="coupled")])


NARRATED = """<dock> ::= "The arm catches the satellite" <capture>
<capture> ::= "They come to each other" <near> <caught>
<near> ::= "the arm closes in" converging(arm, satellite)
<caught> ::= coupled(arm, satellite)"""


def test_texts_of_a_file_are_reported_when_their_stages_begin() -> None:
    played = watch(NARRATED, Script((NEARS, MEETS, HOLDS)), 15.0)
    started = [e.text for e in played.events if e.kind == "stage_started"]
    assert started[0].endswith(
        " The arm catches the satellite. They come to each other. The arm closes in."
    )
    assert not any("closes in" in t or "each other" in t for t in started[1:])


SEVERAL = """task <dock> ::= <near> <caught>
task <meet> ::= <near> touching(arm, satellite)
<near> ::= converging(arm, satellite)
<caught> ::= coupled(arm, satellite)
never gone(satellite) during <caught>
"""


def test_a_file_can_contain_several_tasks(tmp_path: Path) -> None:
    file = tmp_path / "many.task"
    file.write_text(SEVERAL)
    dock, meet = load_tasks(file)
    assert (dock.name, meet.name) == ("dock", "meet")
    assert (len(dock.invariants), len(meet.invariants)) == (1, 0)
    assert load_task(f"{file}:meet") == meet
    with pytest.raises(TaskError, match=r"holds 2 tasks[\s\S]*many.task:dock"):
        load_task(file)
    with pytest.raises(TaskError, match=r"no task `land`[\s\S]*dock, meet"):
        load_task(f"{file}:land")
    played = play(task_reasoner([dock, meet]), Script((NEARS, MEETS)), 15.0, fps=10.0)
    assert [finish(t) for t in played.last.tasks] == [Verdict.IN_PROGRESS, Verdict.SUCCEEDED]


def test_includes_are_relative_and_errors_name_their_own_file(
    tmp_path: Path,
) -> None:
    (tmp_path / "parts").mkdir()
    common = tmp_path / "parts/common.task"
    common.write_text(
        'include "more.task"\n<near> ::= converging(arm, satellite)\n<unused> ::= gone(arm)\n'
    )
    (tmp_path / "parts/more.task").write_text(
        "parameter patience is 60 s\nactor satellite is hubble\n"
    )
    main = tmp_path / "main.task"
    main.write_text(
        'include "parts/common.task"\n<t> ::= <near> within patience <caught>\n'
        'include "dock"\n<caught> ::= coupled(arm, satellite)'
    )
    task = load_task(main)
    assert task.name == "t"
    assert task.models("satellite") == ("hubble",)
    common.write_text('include "more.task"\n<near> ::= convergng(arm, satellite)\n')
    with pytest.raises(TaskError, match=r"parts/common.task:2:12: \[E201\]") as caught:
        load_task(main)
    assert "convergng(arm" in str(caught.value)
    common.write_text('include "../main.task"\n')
    with pytest.raises(TaskError, match="include each other"):
        load_task(main)
