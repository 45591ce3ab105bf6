"""The commands, outlines and tasks of `docs/your-own-cell.md` are those that ship and work."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

import visup
from tests.docs.own_cell import CLIP, PAGE, outlines
from tests.paths import ROOT
from visup.cli import app

TEXT = PAGE.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```\n(.*?)```", TEXT, re.DOTALL)
COMMANDS = [
    line
    for block in BLOCKS
    for line in block.replace("\\\n", " ").splitlines()
    if line.startswith("visup ")
]


def test_the_task_on_the_page_is_the_one_that_ships() -> None:
    assert (ROOT / "examples" / "data" / "bottles.task").read_text() in BLOCKS


@pytest.mark.parametrize("path", ["bottles.task", "bottles_middle.task"])
def test_the_tasks_have_no_mistakes(path: str) -> None:
    done = CliRunner().invoke(app, ["task", "check", str(ROOT / "examples" / "data" / path)])
    assert done.exit_code == 0, done.output


def test_teaching_tells_what_the_page_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    typed = next(c for c in COMMANDS if "--outline" in c)
    words = [str(ROOT / w) if w.startswith("examples/") else w for w in shlex.split(typed)[1:]]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert done.output in BLOCKS
    views = {v.name: v for v in visup.ModelDatabase.open("cell.models").taught}
    assert set(views) == {"left_bottle", "middle_bottle", "right_bottle"}


def test_the_example_teaches_the_same_outlines() -> None:
    code = (ROOT / "examples" / "12_your_own_cell.py").read_text()
    drawn = dict(re.findall(r'"(\w+)": \[(.*?)\],\n', code, re.DOTALL))
    numbers = {name: [float(n) for n in re.findall(r"\d+", text)] for name, text in drawn.items()}
    assert numbers == {n: list(np.ravel(corners)) for n, corners in outlines().items()}
    assert len(code.splitlines()) <= 40


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_and_option_on_the_page_exists(command: str) -> None:
    words = shlex.split(command)[1:]
    names = words[:2] if words[0] in ("models", "task") else words[:1]
    told = CliRunner().invoke(app, [*names, "--help"], env={"COLUMNS": "200"}).output
    for option in {w.partition("=")[0] for w in words if w.startswith("--")}:
        assert option in told
    for path in (w for w in words if w.startswith("examples/")):
        assert (ROOT / path).is_file()


def test_the_clip_that_ships_is_small_and_says_whose_it_is() -> None:
    assert CLIP.stat().st_size < 400_000
    notice = (CLIP.parent / "NOTICE.md").read_text()
    for needed in ("Intel", "creativecommons.org/licenses/by/4.0", "Changes:", CLIP.name):
        assert needed in notice
    clip = cv2.VideoCapture(str(CLIP))
    assert clip.get(cv2.CAP_PROP_FRAME_COUNT) > 90


def test_the_pictures_on_the_page_are_small() -> None:
    names = re.findall(r"\(images/([\w.-]+)\)", TEXT)
    assert len(names) == 3
    for name in names:
        assert (ROOT / "docs" / "images" / name).stat().st_size < 300_000
