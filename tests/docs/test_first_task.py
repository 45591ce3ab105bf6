"""What docs/first-task.md and docs/first-plugin.md show is what comes of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli import caller
from tests.docs.blocks import Block, blocks
from visup.agent.plugins.factory import load_behaviours
from visup.testing import check_behaviour

TASK, PLUGIN = (
    [b for b in blocks() if b.page.name == name] for name in ("first-task.md", "first-plugin.md")
)


def told(words: str) -> str:
    """The block of the page that holds some words."""
    (found,) = (b.text for b in TASK if words in b.text and b.mark)
    return found


def test_the_task_is_checked_and_drawn_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    called = caller(monkeypatch, capfd)
    monkeypatch.chdir(tmp_path)
    text = next(b.text for b in TASK if b.kind == "task")
    path = Path("reach.task")
    path.write_text(text)
    assert called("task", "check", path).out.strip() == f"{path}: ok"
    assert called("task", "show", path).out.strip() == told("├──").strip()
    path.write_text(text.replace("converging", "convergng"))
    said = called("task", "check", path)
    assert said.code == 2
    assert told("convergng") in said.out + said.err


@pytest.mark.parametrize("block", [b for b in PLUGIN if b.kind == "python"], ids=str)
def test_the_plugins_keep_their_contracts(block: Block, tmp_path: Path) -> None:
    (name,) = re.findall(r"class (\w+)", block.text)
    path = tmp_path / f"{name.lower()}.py"
    path.write_text(block.text)
    (behaviour,) = load_behaviours(str(path))
    check_behaviour(behaviour)
