"""The tasks of `examples/tasks`: each trace of a page has the verdict that the page says."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from math import inf

import pytest

from tests.paths import ROOT
from tests.tasks.scripted import RelationSpan, Script, play, task_of
from visup.agent import Reasoner, Verdict
from visup.tasks import parse_task
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import task_actors
from visup.tasks.supervision.supervise import finish, task_reasoner

PAGES = sorted(p for p in (ROOT / "examples" / "tasks").glob("*.md") if p.stem != "README")
BLOCK = re.compile(r"^```(\w+)(?: (\w+))?\n(.*?)^```$", re.S | re.M)
LINE = re.compile(r"([\d.]+)-([\d.]*) (\w+)\(([^()]*)\)")


@dataclass(frozen=True)
class Trace:
    page: str
    task: str
    kind: str
    lines: str

    def __str__(self) -> str:
        return f"{self.page} {self.kind}"


def traces() -> list[Trace]:
    found = []
    for page in PAGES:
        blocks = BLOCK.findall(page.read_text("utf-8"))
        task = next(text for kind, _, text in blocks if kind == "task")
        found += [
            Trace(page.stem, task, said, text) for kind, said, text in blocks if kind == "trace"
        ]
    return found


@cache  # all traces of a page are of one task
def supervised(text: str) -> tuple[Task, Reasoner]:
    task = parse_task(text)
    return task, task_reasoner([task])


def played(trace: Trace) -> Verdict:
    task, supervisor = supervised(trace.task)
    rows = [LINE.fullmatch(line) for line in trace.lines.splitlines()]
    assert all(rows), trace
    said = [(float(m[1]), float(m[2] or inf), m[3], tuple(m[4].split(", "))) for m in rows if m]
    waited = (a for a in task_actors(task) if not task.actor(a).spare)
    names = dict.fromkeys((*waited, *(w for *_, who in said for w in who)))
    number = {n: k for k, n in enumerate(names, 1)}
    spans, leaves = [], dict.fromkeys(number, 1e9)
    for begin, end, action, who in said:
        if action == "gone":
            leaves[who[0]] = begin
            continue
        pair = (number[who[0]], number[who[1]])
        spans.append(RelationSpan(action, begin + 0.6 * (action == "coupled"), end, pair))
        if action == "coupled":  # what is coupled touches, a little before
            spans.append(RelationSpan("touching", begin, end, pair))
    last = max([e for b, e, *_ in said if e < inf] + [b for b, *_ in said])
    script = Script(
        tuple(spans),
        objects={number[n]: (0.0, leaves[n]) for n in number},
        identities={k: {next(iter(task.models(n)), n): 0.9} for n, k in number.items()},
    )
    return finish(task_of(play(supervisor, script, last + 14.0, fps=5.0)))


def test_there_are_twelve_real_tasks() -> None:
    assert len(PAGES) == 12
    assert {t.page for t in traces() if t.kind == "good"} == {p.stem for p in PAGES}
    assert {t.page for t in traces() if t.kind == "bad"} == {p.stem for p in PAGES}


@pytest.mark.parametrize("trace", traces(), ids=str)
def test_each_trace_has_its_documented_verdict(trace: Trace) -> None:
    assert (played(trace) is Verdict.SUCCEEDED) == (trace.kind == "good")
