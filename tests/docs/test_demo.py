"""README's story is what `visup demo` prints."""

from __future__ import annotations

import re

import pytest
from rich.console import Console

import visup
from tests.paths import ROOT
from visup.runs.demo import demo_settings
from visup.terminal.narrator import event_row, verdict_line


@pytest.mark.timeout(900)
def test_the_story_in_the_readme_is_that_of_the_demo() -> None:
    run = visup.watch(demo_settings())
    console = Console(width=80, record=True)
    for event in run.events:
        console.print(event_row(event))
    console.print(verdict_line(run.verdict))
    printed = {line.rstrip() for line in console.export_text().splitlines()}
    story = re.findall(r"```\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[0]
    assert [line for line in story.splitlines() if line.rstrip() not in printed] == []
