"""Examples are programs that run; what the docs show works as it stands there."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agent.scripted import frames
from visup.agent.agent import Agent
from visup.agent.registry import from_file

ROOT = Path(__file__).resolve().parents[2]
SAYS = {
    "01_watch_a_clip.py": "verdict: ",
    "02_look_into_the_mind.py": "object 1",
    "03_write_a_task.py": "keeping_distance",
    "04_own_behaviour.py": "a lamp at",
    "05_match_a_silhouette.py": ", view ",
}


def test_every_example_is_tried() -> None:
    assert {p.name for p in (ROOT / "examples").glob("*.py")} == set(SAYS)


@pytest.mark.parametrize("name", sorted(SAYS))
def test_an_example_runs_and_ends_in_something_visible(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / name)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout
    assert "Traceback" not in done.stderr


def test_the_behaviour_in_the_docs_runs_as_it_stands_there_and_is_short(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "plugins.md").read_text()
    code = re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0]
    assert len(code.splitlines()) < 40
    path = tmp_path / "lamp.py"
    path.write_text(code)
    last = Agent(from_file(path)).run(frames(3))
    assert last is not None
    assert [r.error for r in last.reports] == [""]


def test_links_between_docs_lead_somewhere() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    broken = [
        f"{page.name}: {target}"
        for page in pages
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text())
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert broken == []
