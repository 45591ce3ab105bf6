"""The tree of a task on the page, in the colours of its stages."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from html import unescape
from re import findall

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.report.scene import run
from visup.agent import Status
from visup.report.collector import Collector
from visup.report.page.html import report_page
from visup.report.page.task_trees import stage_changes, task_trees
from visup.report.records import RunData, StateSpan
from visup.tasks.checks.load import parse_task
from visup.tasks.tools.outline import Branch, outline

DOCK = """<dock> ::= <approach> <captured>
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite)
"""


@cache
def scene() -> RunData:
    collector = Collector()
    for step, frame in run((160, 120), "dock"):
        collector.add(step, frame)
    return collector.finish(task_trees=[outline(parse_task(DOCK))])


def told(html: str) -> list[tuple[str, str, list[list[object]]]]:
    """(status shown, stage, changes) of each stage on the page."""
    found = findall(r'class="step (\w+)" data-changes="([^"]*)"><b>([^<]*)</b>', html)
    return [(status, unescape(stage), json.loads(unescape(data))) for status, data, stage in found]


def test_each_stage_has_the_colour_of_its_final_status() -> None:
    ended = {s.stage: s.status.value for s in scene().tasks[0].stages}
    shown = told(task_trees(scene()))
    assert {stage: status for status, stage, _ in shown} == ended
    assert len(shown) == len(ended)


def test_the_slider_has_every_change_of_the_run() -> None:
    for _, stage, steps in told(task_trees(scene())):
        spans = [s for s in scene().spans if s.subject == ("stage", "dock", stage)]
        assert [value for _, value in steps] == [s.value for s in spans]
        times = [float(str(since)) for since, _ in steps]
        assert times == sorted(times)
        assert times == pytest.approx([s.start for s in spans], abs=1e-3)


@given(st.lists(st.tuples(st.floats(0, 99), st.sampled_from(list(Status))), max_size=8))
def test_changes_of_a_stage_are_in_order(moments: list[tuple[float, Status]]) -> None:
    spans = [StateSpan(("stage", "t", "a"), s.value, at, at + 1) for at, s in moments]
    other = StateSpan(("stage", "t", "b"), "done", 0, 1)
    found = stage_changes(RunData("x", spans=(*spans, other)), "t", "a")
    assert [t for t, _ in found] == sorted(t for t, _ in found)
    assert sorted(v for _, v in found) == sorted(s.value for s in spans)


def test_text_of_files_is_escaped() -> None:
    evil = "<script>alert(1)</script>\"'"
    tree = Branch(evil, "task", "", (Branch(evil, "stage", evil), Branch(evil, "words", evil)))
    data = RunData("x", spans=(StateSpan(("stage", evil, evil), "done", 0, 1),), task_trees=(tree,))
    page = report_page(data)
    assert "<script>alert" not in page
    assert told(task_trees(data)) == [("done", unescape(_escaped(evil)), [[0, "done"]])]


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def test_without_a_task_nothing_is_drawn() -> None:
    assert task_trees(replace(scene(), task_trees=())) == ""
