"""README's story is what `visup demo` prints, and what the first example watches."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest
from rich.console import Console

from tests.paths import ROOT
from visup.terminal.narrator import event_row, verdict_line


@pytest.mark.timeout(900)
def test_the_first_example_runs_and_the_story_in_the_readme_is_what_it_saw(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both in one, since both watch the whole clip with the settings of the demo."""
    monkeypatch.chdir(tmp_path)
    names = runpy.run_path(str(ROOT / "examples" / "01_watch_a_clip.py"), run_name="__main__")
    assert "verdict: failed" in capsys.readouterr().out
    assert list(tmp_path.glob("alert-*.png"))
    run = names["run"]
    console = Console(width=80, record=True)
    for event in run.events:
        console.print(event_row(event))
    console.print(verdict_line(run.verdict))
    printed = {line.rstrip() for line in console.export_text().splitlines()}
    story = re.findall(r"```\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[0]
    assert [line for line in story.splitlines() if line.rstrip() not in printed] == []
