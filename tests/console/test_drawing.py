"""What is drawn over the picture and of the task: well-formed, in its place, and what was believed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.archive.recordings import meeting, record
from tests.console.test_runs import SETTINGS
from visup.agent import Event, Mind, StageBelief, Status, TaskBelief, Verdict, Zone
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Prospect
from visup.console.drawing.flow_layout import layout_of
from visup.console.drawing.flow_svg import flow_svg
from visup.console.drawing.overlay_svg import DRAWN, overlay_svg, vectors_of
from visup.console.pages.playhead import Playhead
from visup.console.questions import questions_at
from visup.console.reasoning.inquiry import Inquiry
from visup.console.run_view import RunView
from visup.tasks import load_tasks, shipped_tasks
from visup.tasks.tools.diagram import BEGIN, END, Flow, Node, flow_of


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Sequence[Step]]:
    folder = tmp_path_factory.mktemp("runs") / "one"
    return folder, record(folder, meeting(), SETTINGS)


@st.composite
def flows(draw: st.DrawFn) -> Flow:
    count = draw(st.integers(1, 9))
    names = [f"n{k}" for k in range(count)]
    flow = Flow({n: Node((f"<{n}>", "touching(a, b)"), n) for n in names})
    flow.link([BEGIN], [names[0]])
    flow.link([names[-1]], [END])
    ends = st.sampled_from(names)
    for a, b in draw(st.lists(st.tuples(ends, ends), max_size=14)):
        flow.link([a], [b])
    return flow


@given(flows())
def test_arrows_lead_down_but_for_those_that_lead_back_and_no_box_covers_another(
    flow: Flow,
) -> None:
    placed = layout_of(flow)
    assert set(placed.boxes) == {BEGIN, END, *flow.nodes}
    for a, b in set(flow.edges) - placed.back:
        assert placed.boxes[a].y + placed.boxes[a].height < placed.boxes[b].y
    for one in placed.boxes.values():
        assert one.x >= 0
        assert one.x + one.width <= placed.width
        assert one.y + one.height <= placed.height
        for two in placed.boxes.values():
            aside = one.x + one.width <= two.x or two.x + two.width <= one.x
            assert one is two or aside or one.y + one.height <= two.y or two.y + two.height <= one.y


@pytest.mark.parametrize("name", shipped_tasks())
def test_every_shipped_task_has_a_drawing_with_all_its_stages(name: str) -> None:
    for task in load_tasks(name):
        flow = flow_of(task)
        picture = ET.fromstring(flow_svg(flow, TaskBelief(task.name, Verdict.UNKNOWN)))
        drawn = [t.text or "" for t in picture.iter("text")]
        assert all(n.stage.replace("_", " ")[:8] in " ".join(drawn) for n in flow.nodes.values())


def test_the_flow_says_how_sure_each_stage_is_and_what_may_come_next() -> None:
    belief = TaskBelief(
        "dock",
        Verdict.IN_PROGRESS,
        (
            StageBelief("approach", Status.PROGRESSING, 0.0, 0.82),
            StageBelief("captured", Status.PENDING, 0.0),
        ),
        "approach",
        prospects=(Prospect("captured", 0.7), Prospect("", 0.1)),
        success=0.6,
    )
    (task,) = load_tasks("dock")
    drawn = flow_svg(flow_of(task), belief)
    assert "progressing 82 %" in drawn
    assert "next 70 %" in drawn
    assert "next 10 %" in drawn
    assert "82 %" not in flow_svg(flow_of(task), replace(belief, success=None))


def test_the_journal_keeps_how_sure_stages_are(run: tuple[Path, Sequence[Step]]) -> None:
    folder, steps = run
    view = RunView(folder)
    assert set(view.flows) == {"dock"}
    for number, step in enumerate(steps):
        for read, told in zip(view.mind(number).tasks, step.mind.tasks, strict=True):
            assert [s.stage for s in read.stages] == [s.stage for s in told.stages]
            for one, other in zip(read.stages, told.stages, strict=True):
                assert one.confidence == pytest.approx(other.confidence, abs=6e-4)
            assert [p.stage for p in read.prospects] == [p.stage for p in told.prospects]
            assert read.success == pytest.approx(told.success, abs=6e-4)


def test_relations_are_lines_between_those_whom_they_hold_of(
    run: tuple[Path, Sequence[Step]],
) -> None:
    folder, steps = run
    asked = Inquiry(folder)
    for number in (12, 40, 59):
        mind = asked.mind(number + 1)
        vectors = vectors_of(mind)
        assert vectors == vectors_of(steps[number].mind)
        assert vectors
        for v in vectors:
            assert v.name in DRAWN
            assert mind.relation(v.name, *v.objects) is not None
            assert v.ends == tuple(mind.objects[i].region.centroid for i in v.objects)
        picture = ET.fromstring(overlay_svg(mind, vectors, {}, [], 1))
        assert len(list(picture.iter("{*}g")) or list(picture.iter("g"))) == len(vectors)


@given(st.text("<>&\"'/ab", max_size=12))
def test_names_cannot_break_out_of_the_drawing(name: str) -> None:
    zone = Zone(name, ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)))
    picture = ET.fromstring(overlay_svg(Mind(frame_size=(64, 48), zones=(zone,))))
    assert {e.tag for e in picture.iter()} <= {"svg", "polygon", "text"}


def test_trails_end_where_objects_are_and_come_from_where_they_were(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    trail = view.trails(30)[1]
    x, y, w, h = view.mind(30).objects[1].region.bbox
    assert trail[-1] == (x + w / 2, y + h / 2)
    assert [p[0] for p in trail] == sorted(p[0] for p in trail)
    assert view.trails(0) == {}
    assert all(len(points) <= 60 for points in view.trails(59).values())


def test_what_was_clicked_is_the_smallest_there_and_its_names_have_similarities(
    run: tuple[Path, Sequence[Step]],
) -> None:
    head = Playhead(RunView(run[0]))
    head.go(30)
    x, y, w, h = head.run.mind(30).objects[2].region.bbox
    head.point(x + w / 2, y + h / 2)
    assert head.chosen == 2
    assert [(h.name, round(h.similarity, 2)) for h in head.run.looks(30, 2)] == [
        ("spartan", 0.9),
        ("arm", 0.2),
    ]
    assert head.run.looks(30, 99) == ()
    head.point(1.0, 1.0)
    assert head.chosen is None


def test_a_question_waits_until_it_is_answered_or_its_object_is_gone() -> None:
    def told(kind: str, time: float, number: int) -> Event:
        return Event(kind, time, 0, "Is it?", (number,), data={"names": ["arm", "cup"]})

    asked = (told("question", 1, 2), told("question", 2, 3))
    events = (*asked, told("answer", 5, 2), told("exit", 7, 3))
    waiting = {t: [q.object_id for q in questions_at(events, t)] for t in (0, 1, 3, 5, 8)}
    assert waiting == {0: [], 1: [2], 3: [2, 3], 5: [3], 8: []}
    assert questions_at(events, 1)[0].names == ("arm", "cup")
