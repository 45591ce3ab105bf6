from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.cli import caller
from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import VisupError
from visup.agent.plugins.factory import load_behaviours
from visup.agent.plugins.isolated import IsolatedBehaviour
from visup.cli import app
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent
from visup.testing import check_behaviour


def visup(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(w) for w in arguments])
    if isinstance(result.exception, VisupError):
        return 2, str(result.exception)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.output


@pytest.mark.parametrize("name", ["lamp", "two_words", "_", "Lamp2"])
def test_a_new_behaviour_keeps_its_contract(name: str, tmp_path: Path) -> None:
    code, _ = visup("behaviours", "new", name, "--out", tmp_path)
    assert code == 0
    (behaviour,) = load_behaviours(str(tmp_path / f"{name}.py"))
    assert behaviour.contract.name == name
    check_behaviour(behaviour)
    assert len((tmp_path / f"{name}.py").read_text().splitlines()) < 40


def test_existing_files_are_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "lamp.py").write_text("mine")
    code, output = visup("behaviours", "new", "lamp", "--out", tmp_path)
    assert (code, "already exists" in output) == (2, True)
    assert (tmp_path / "lamp.py").read_text() == "mine"


@pytest.mark.parametrize("name", ["two words", "class", "1st", ""])
def test_invalid_names_are_refused(name: str, tmp_path: Path) -> None:
    code, output = visup("behaviours", "new", name, "--out", tmp_path)
    assert (code, "not a valid name for a behaviour" in output) == (2, True)


def test_check_prints_its_results_and_sets_the_exit_code(tmp_path: Path) -> None:
    visup("behaviours", "new", "lamp", "--out", tmp_path)
    path = tmp_path / "lamp.py"
    code, output = visup("behaviours", "check", path)
    assert (code, output.count("ok ")) == (0, 14)
    path.write_text(path.read_text().replace("(x, y)", "float('nan')"))
    code, output = visup("behaviours", "check", path, "--set", "lamp.contrast=1")
    assert code == 1
    assert (
        "failed runs on a disc that moves: frame 0: behaviour 'lamp' reported 'lamp' as nan"
        in output
    )
    assert "expected a finite number, or None" in output
    assert visup("behaviours", "check", tmp_path / "none.py")[0] == 2
    code, output = visup("behaviours", "check", path, "--set", "lamp.contrast=-1")
    assert (code, "expected: greater than 0" in output) == (2, True)


def test_list_shows_installed_behaviours_within_80_columns() -> None:
    code, output = visup("behaviours", "list")
    assert code == 0
    assert all(name in output for name in ("motion", "shape", "depth", "health"))
    assert max(map(len, output.splitlines())) <= 80


def test_an_installed_behaviour_is_checked_by_name() -> None:
    code, output = visup("behaviours", "check", "health")
    assert (code, "failed" in output) == (0, False)


def test_settings_and_isolation_reach_the_agent(tmp_path: Path) -> None:
    visup("behaviours", "new", "lamp", "--out", tmp_path)
    settings = WatchSettings(
        "clip.mp4",
        behaviours=(tmp_path / "lamp.py",),
        plugin_settings={"lamp": {"contrast": 7}},
        isolate=("lamp",),
        budgets=True,
    )
    agent = build_agent(settings)
    lamp = next(b for b in agent.behaviours if b.contract.name == "lamp")
    # It runs in a process of its own, and so is never made in this one.
    assert isinstance(lamp, IsolatedBehaviour)
    assert lamp.settings == {"contrast": 7}
    unisolated = build_agent(replace(settings, isolate=()))
    lamp = next(b for b in unisolated.behaviours if b.contract.name == "lamp")
    assert lamp.settings.contrast == 7  # type: ignore[attr-defined]
    assert (set(agent.limits.isolate), agent.limits.budgets) == ({"lamp"}, True)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--set", "lamp.contrast=3"), "there is no behaviour called 'lamp' to set"),
        (("--set", "lamp"), "cannot be read"),
        (("--settings", "none.toml"), "No such file"),
        (("--isolate", "lamp"), "called 'lamp' to isolate"),
    ],
)
def test_invalid_settings_are_refused_before_the_run(
    options: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(3))
    code, output = visup("watch", clip, "--out", tmp_path / "run", *options)
    assert (code, message in output) == (2, True), output


def test_a_run_continues_after_an_isolated_behaviour_dies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    clip = write_clip(tmp_path / "clip.avi", moving_disc(12))
    (tmp_path / "mine.py").write_text(
        "import os\n"
        "from visup.agent import Contract\n"
        "class Mine:\n"
        "    contract = Contract('mine', gives=('mine',))\n"
        "    def perceive(self, frame, observation, directives):\n"
        "        os._exit(7)\n"
    )
    arguments = ["--behaviour", "mine.py", "--isolate", "mine", "--out", "run"]
    done = caller(monkeypatch, capfd)("watch", clip, "--json", "--no-video", *arguments)
    assert done.code == 1, done.err
    assert done.err == ""
    assert "The behaviour 'mine' failed; its output is unavailable." in done.out
    assert "its process ended with exit code 7" in done.out
    assert '"frames": 12' in done.out
