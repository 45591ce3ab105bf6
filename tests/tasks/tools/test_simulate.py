from __future__ import annotations

from itertools import islice, product, takewhile
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.tasks.automaton.test_derivatives import small
from visup.commands.task.task import app
from visup.tasks import load_task, parse_task, shipped_tasks
from visup.tasks.grammar.nodes import Course, Stage, Task
from visup.tasks.tools.diagram import dot, flow_of, mermaid
from visup.tasks.tools.simulate import initial_positions, sample, successors, traces

runner = CliRunner()


def text(task: str, count: int) -> list[tuple[tuple[str, ...], ...]]:
    return list(islice(traces(parse_task(task)), count))


def test_sequences_are_listed_shortest_first() -> None:
    found = list(islice(traces(load_task("dock_with_retry")), 3))
    assert [len(c) for c in found] == [2, 4, 6]
    assert found[0] == (
        ("<approach> converging(arm, satellite)",),
        ("<captured> coupled(arm, satellite)",),
    )


@pytest.mark.parametrize(
    ("course", "count"),
    [
        ("seen(a) at least 2 times at most 4 times", 3),
        ("seen(a) at most 3 times", 3),
        ("seen(a) at least 0 times at most 2 times", 3),
        ("any order (seen(a), seen(b), seen(c))", 6),
        ("any order (seen(a) seen(b), seen(c))", 2),
        ("seen(a)? (seen(b) | seen(c))", 4),
        ("gap(a, b) < 5 px seen(a)", 1),
    ],
)
def test_every_legal_sequence_is_listed_once(course: str, count: int) -> None:
    assert len(text(f"<t> ::= {course}", 50)) == count


def test_stages_of_an_optional_actor_can_be_skipped() -> None:
    assert len(text("optional actor b\n<t> ::= seen(a) seen(b)", 9)) == 2


@settings(max_examples=40, deadline=None)
@given(small, st.integers(0, 10**6))
def test_a_random_sequence_is_among_those_listed(course: Course, seed: int) -> None:
    task = Task((Stage("t", course),))
    drawn, ended = sample(task, Random(seed))
    assert ended
    if len(drawn) <= 4:
        assert drawn in takewhile(lambda c: len(c) <= len(drawn), traces(task))


def test_successors_include_the_end() -> None:
    task = load_task("dock")
    (first,) = initial_positions(task)
    (second,) = successors(task, first)
    (end,) = successors(task, second)
    assert second.moment == ("<captured> coupled(arm, satellite)",)
    assert end.state is None
    assert successors(task, end) == ()


def test_the_command_walks_lists_and_samples() -> None:
    walked = runner.invoke(app, ["simulate", "dock"], input="1\nx\n1\n\n")
    assert walked.exit_code == 0
    assert "a number from 1 to 1, or q" in walked.output
    assert walked.output.rstrip().endswith("the task is done")
    assert runner.invoke(app, ["simulate", "dock"], input="").exit_code == 0
    listed = runner.invoke(app, ["simulate", "dock_with_retry", "--list", "2"]).output.splitlines()
    assert [line[:2] for line in listed] == ["1.", "2.", "an"]
    drawn = [
        runner.invoke(app, ["simulate", "handover", "--sample", "3", "--seed", s]).output
        for s in ("1", "1", "2")
    ]
    assert drawn[0] == drawn[1]
    assert len(drawn[0].splitlines()) == 3


@pytest.mark.parametrize("name", shipped_tasks())
def test_every_edge_of_a_diagram_connects_its_nodes(name: str) -> None:
    flow = flow_of(load_task(name))
    ends = {"start", "finish", *flow.nodes}
    assert all(a in ends and b in ends for a, b in flow.edges)
    reached, todo = set(), ["start"]
    while todo:
        node = todo.pop()
        if node not in reached:
            reached.add(node)
            todo += [b for a, b in flow.edges if a == node]
    assert reached == ends
    for node_name, diagram in product(flow.nodes, (mermaid(flow), dot(flow))):
        assert f"    {node_name} [" in diagram or f"    {node_name}[" in diagram


def test_the_commands_draw_diagrams_and_format_files(tmp_path: Path) -> None:
    assert runner.invoke(app, ["show", "dock", "--format", "mermaid"]).output.startswith(
        "flowchart"
    )
    assert runner.invoke(app, ["show", "dock", "--format", "dot"]).output.startswith("digraph")
    file = tmp_path / "a.task"
    file.write_text("<dock>::=\tcoupled(arm , satellite) # held\n")
    assert runner.invoke(app, ["format", "--check", str(file)]).exit_code == 1
    assert runner.invoke(app, ["format", str(file)]).exit_code == 0
    assert file.read_text() == "<dock> ::= coupled(arm, satellite)  # held\n"
    assert runner.invoke(app, ["format", "--check", str(file), "dock"]).exit_code == 0
    piped = runner.invoke(app, ["format", "-"], input="<a>::=seen(b)").output
    assert piped == "<a> ::= seen(b)\n"
    bad = runner.invoke(app, ["format", "-"], input="<a>:=seen(b)")
    assert "[E102]" in str(bad.exception)


def test_the_commands_explain_codes_and_list_actions() -> None:
    assert runner.invoke(app, ["explain", "E102"]).output.startswith("E102: ")
    listed = runner.invoke(app, ["actions"]).output
    for text in (
        "coupled(a, b)",
        "gap(a, b) < 5 px",
        "time_to_contact(a, b) < 5 s",
        "inside(a, zone)",
    ):
        assert text in listed
    assert '"coupled"' in runner.invoke(app, ["actions", "--json"]).output
    assert "no kind of percept" in str(
        runner.invoke(app, ["check", "dock", "--without", "x"]).exception
    )
    assert '"source.visup-task"' in runner.invoke(app, ["textmate"]).output
