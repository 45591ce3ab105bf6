"""Every public record shows itself at 80 columns, and as HTML."""

from __future__ import annotations

import io
import subprocess
import sys

import numpy as np
import pytest
from rich.console import Console

import visup.agent as agent
from tests.stepping.timelines import reasoning_course, reasoning_stepper
from visup.agent import Directive, Frame, Percept, Report, ReportState
from visup.terminal.display import html, shown


def records() -> list[object]:
    step = reasoning_course()[30]
    mind = step.mind
    it = reasoning_stepper(40)
    stopped = it.step(30)
    halted = it.step(until="match")
    return [
        *(step, mind, step.observation, *step.reports, *step.observation.reports[1].percepts),
        *(mind.objects.values(), *mind.objects.values(), mind.relations, mind.relations[0]),
        *(*mind.tasks, *mind.tasks[0].stages, *mind.alerts, mind.health, mind.tasks[0].bindings[0]),
        *(e for s in reasoning_course() for e in s.events),
        *(step.observation.of("region")[0], step.observation.of("hypothesis")[0]),
        *(step.observation.of("depth")[0], Frame(3, 0.1, np.zeros((4, 6, 3), np.uint8))),
        *(Directive("look_at", "It went there.", {"bbox": (1, 2, 3, 4)}), it.diff(3, 30), stopped),
        *(halted, halted.paused, it.why("alert 1"), it.diff(3, 30).changes[0]),
        Percept("lamp", {"on": True, "image": np.zeros((9, 9))}, 0.1, "lamp"),
        Report("lamp", ReportState.FAILED, ("lamp",), (), "ValueError: broken"),
    ]


def test_every_record_fits_80_columns_and_is_html() -> None:
    for record in records():
        out = io.StringIO()
        console = Console(file=out, width=80)
        console.print(shown(record))
        text = out.getvalue()
        assert text.strip()
        assert all(len(line) <= 80 for line in text.splitlines())
        if hasattr(record, "_repr_html_"):
            assert record._repr_html_().startswith("<pre")
            console.print(record)
            assert out.getvalue() == text * 2


NOT_SHOWN = (
    *("Agent", "AgentSnapshot", "Column", "Contract", "Limits", "MemoryKey", "PastFrame"),
    "Reasoners",
)


@pytest.mark.parametrize("name", [n for n in agent.__all__ if n[0].isupper()])
def test_public_records_of_the_agent_have_a_display(name: str) -> None:
    kind = getattr(agent, name)
    if hasattr(kind, "__dataclass_fields__") and name not in NOT_SHOWN:
        assert hasattr(kind, "_repr_html_")
        assert hasattr(kind, "__rich__")


def test_html_is_escaped() -> None:
    assert "<script" not in html(Directive("ask", "<script>alert(1)</script>"))


def test_the_agent_imports_no_drawing() -> None:
    code = "import visup.agent, visup.agent.cycle.agent, sys; print([m for m in sys.modules if m == 'rich'])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
