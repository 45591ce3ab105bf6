"""Overlays and flow charts are valid SVG and show the beliefs."""

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
from visup.console.drawing.overlay_svg import DRAWN_RELATIONS, overlay_svg, relation_lines
from visup.console.pages.playhead import Playhead
from visup.console.questions import open_questions
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
def test_only_back_edges_lead_up_and_boxes_do_not_overlap(
    flow: Flow,
) -> None:
    layout = layout_of(flow)
    assert set(layout.boxes) == {BEGIN, END, *flow.nodes}
    for a, b in set(flow.edges) - layout.back_edges:
        assert layout.boxes[a].y + layout.boxes[a].height < layout.boxes[b].y
    for one in layout.boxes.values():
        assert one.x >= 0
        assert one.x + one.width <= layout.width
        assert one.y + one.height <= layout.height
        for two in layout.boxes.values():
            aside = one.x + one.width <= two.x or two.x + two.width <= one.x
            assert one is two or aside or one.y + one.height <= two.y or two.y + two.height <= one.y


@pytest.mark.parametrize("name", shipped_tasks())
def test_the_flow_chart_of_every_shipped_task_shows_all_stages(name: str) -> None:
    for task in load_tasks(name):
        flow = flow_of(task)
        drawing = ET.fromstring(flow_svg(flow, TaskBelief(task.name, Verdict.UNKNOWN)))
        drawn = [t.text or "" for t in drawing.iter("text")]
        assert all(n.stage.replace("_", " ")[:8] in " ".join(drawn) for n in flow.nodes.values())


def test_the_flow_chart_shows_confidences_and_prospects() -> None:
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


def test_confidences_of_stages_are_read_from_the_journal(run: tuple[Path, Sequence[Step]]) -> None:
    folder, steps = run
    view = RunView(folder)
    assert set(view.flows) == {"dock"}
    for number, step in enumerate(steps):
        for read, original in zip(view.mind(number).tasks, step.mind.tasks, strict=True):
            assert [s.stage for s in read.stages] == [s.stage for s in original.stages]
            for one, other in zip(read.stages, original.stages, strict=True):
                assert one.confidence == pytest.approx(other.confidence, abs=6e-4)
            assert [p.stage for p in read.prospects] == [p.stage for p in original.prospects]
            assert read.success == pytest.approx(original.success, abs=6e-4)


def test_relations_are_lines_between_their_objects(
    run: tuple[Path, Sequence[Step]],
) -> None:
    folder, steps = run
    inquiry = Inquiry(folder)
    for number in (12, 40, 59):
        mind = inquiry.mind(number + 1)
        lines = relation_lines(mind)
        assert lines == relation_lines(steps[number].mind)
        assert lines
        for line in lines:
            assert line.name in DRAWN_RELATIONS
            assert mind.relation(line.name, *line.objects) is not None
            assert line.ends == tuple(mind.objects[i].region.centroid for i in line.objects)
        drawing = ET.fromstring(overlay_svg(mind, lines, {}, [], 1))
        assert len(list(drawing.iter("{*}g")) or list(drawing.iter("g"))) == len(lines)


@given(st.text("<>&\"'/ab", max_size=12))
def test_names_are_escaped_in_the_overlay(name: str) -> None:
    zone = Zone(name, ((0.0, 0.0), (9.0, 0.0), (9.0, 9.0)))
    drawing = ET.fromstring(overlay_svg(Mind(frame_size=(64, 48), zones=(zone,))))
    assert {e.tag for e in drawing.iter()} <= {"svg", "polygon", "text"}


def test_trails_end_at_the_current_positions(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    trail = view.trails(30)[1]
    x, y, w, h = view.mind(30).objects[1].region.bbox
    assert trail[-1] == (x + w / 2, y + h / 2)
    assert [p[0] for p in trail] == sorted(p[0] for p in trail)
    assert view.trails(0) == {}
    assert all(len(points) <= 60 for points in view.trails(59).values())


def test_a_click_selects_the_smallest_object_and_its_matches_have_similarities(
    run: tuple[Path, Sequence[Step]],
) -> None:
    head = Playhead(RunView(run[0]))
    head.go(30)
    x, y, w, h = head.run.mind(30).objects[2].region.bbox
    head.click(x + w / 2, y + h / 2)
    assert head.selected == 2
    assert [(h.name, round(h.similarity, 2)) for h in head.run.matches(30, 2)] == [
        ("spartan", 0.9),
        ("arm", 0.2),
    ]
    assert head.run.matches(30, 99) == ()
    head.click(1.0, 1.0)
    assert head.selected is None


def test_a_question_is_open_until_it_is_answered_or_its_object_leaves() -> None:
    def event(kind: str, time: float, number: int) -> Event:
        return Event(kind, time, 0, "Is it?", (number,), data={"names": ["arm", "cup"]})

    questions = (event("question", 1, 2), event("question", 2, 3))
    events = (*questions, event("answer", 5, 2), event("exit", 7, 3))
    open_ids = {t: [q.object_id for q in open_questions(events, t)] for t in (0, 1, 3, 5, 8)}
    assert open_ids == {0: [], 1: [2], 3: [2, 3], 5: [3], 8: []}
    assert open_questions(events, 1)[0].names == ("arm", "cup")
