"""Examples are programs that run; what the docs show works as it stands there."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.paths import ROOT
from visup.agent.plugins.factory import load_behaviours
from visup.testing import check_behaviour

WATCHED = "01_watch_a_clip.py"
"""It watches what `tests/docs/test_demo.py` needs, and is tried there."""
SAYS = {
    "02_look_into_the_mind.py": "object 1",
    "03_write_a_task.py": "keeping_distance",
    "04_own_behaviour.py": "a lamp at",
    "05_match_a_silhouette.py": ", view ",
    "06_onnx_detector.py": "detections, the first at ((",
    "07_marker_pose.py": "marker 7 is 0.5",
    "08_depth_camera.py": "region 1 at 4.0 m",
    "10_step_and_ask_why.py": "it rests on ",
    "11_call_a_closer_look.py": "'closer_look' is called for object 1.",
    "12_your_own_cell.py": "verdict: succeeded",
    "09_another_process.py": "late: it gave no answer within 500 ms",
}
APART = "09_another_process.py"
"""It starts a process of its own, which finds its behaviour in the program that was started."""
NEEDS = {"06_onnx_detector.py": ("onnx", "onnxruntime")}


def test_every_example_is_tried() -> None:
    assert {p.name for p in (ROOT / "examples").glob("*.py")} == {WATCHED, *SAYS}


@pytest.mark.parametrize("name", sorted(SAYS.keys() - {APART}))
def test_an_example_runs_and_ends_in_something_visible(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Within this process: to start one for each takes as long as what most of them do."""
    for module in NEEDS.get(name, ()):
        pytest.importorskip(module, reason=f"{name} needs {module}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(ROOT / "examples" / name)])
    runpy.run_path(str(ROOT / "examples" / name), run_name="__main__")
    said = capfd.readouterr()
    assert SAYS[name] in said.out
    assert "Traceback" not in said.err


def test_an_example_runs_as_a_program(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / APART)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert SAYS[APART] in done.stdout
    assert "Traceback" not in done.stderr


def test_the_behaviours_in_the_docs_run_as_they_stand_there_and_are_short(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "plugins.md").read_text()
    codes = [c for c in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "class " in c]
    assert len(codes) >= 2
    for number, code in enumerate(codes):
        assert len(code.splitlines()) < 40
        path = tmp_path / f"plugin_{number}.py"
        path.write_text(code)
        for behaviour in load_behaviours(str(path)):
            check_behaviour(behaviour)


def test_the_test_in_the_docs_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "docs" / "plugins.md").read_text()
    codes = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (tmp_path / "lamp.py").write_text(codes[0])
    monkeypatch.syspath_prepend(tmp_path)
    tests: dict[str, Any] = {}
    exec(next(c for c in codes if "def test_" in c), tests)
    called = [value() for name, value in tests.items() if name.startswith("test_")]
    assert called


def test_links_between_docs_lead_somewhere() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    broken = [
        f"{page.name}: {target}"
        for page in pages
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text())
        if "://" not in target and not (page.parent / target).exists()
    ]
    assert broken == []
