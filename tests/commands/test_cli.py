"""The command as a user meets it: exit codes, one clear message each, never a traceback."""

from __future__ import annotations

import json
import os
import re
import sqlite3
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from tests.paths import ROOT
from visup.commands.doctor import EXTRAS, LIBRARIES, speeds
from visup.runs.inputs.presets import PRESETS

MISTAKES = """\
<dock> ::= <approach> <captured>
<approach> ::= convergin(arm, satellite)
<captured> := coupled(arm, satellite)
<again> ::= diverging(arm
"""


Make = Callable[[Path], list[object]]


@pytest.fixture
def visup(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Call:
    monkeypatch.chdir(tmp_path)
    return caller(monkeypatch, capfd)


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    return write_clip(tmp_path / "clip.avi", moving_disc())


def text_named_mp4(folder: Path) -> list[object]:
    (folder / "story.mp4").write_text("once upon a time\n" * 50)
    return ["watch", folder / "story.mp4"]


def missing_video(folder: Path) -> list[object]:
    return ["watch", folder / "nothing.mp4"]


def folder_without_images(folder: Path) -> list[object]:
    (folder / "empty").mkdir()
    return ["watch", folder / "empty"]


def task_with_mistakes(folder: Path) -> list[object]:
    (folder / "bad.task").write_text(MISTAKES)
    return ["task", "check", folder / "bad.task"]


def watch_with_bad_task(folder: Path) -> list[object]:
    (folder / "bad.task").write_text(MISTAKES)
    return ["watch", folder / "clip.avi", "--task", folder / "bad.task"]


def foreign_database(folder: Path) -> list[object]:
    db = sqlite3.connect(folder / "other.db")
    db.execute("CREATE TABLE t (x)")
    db.commit()
    db.close()
    return ["watch", folder / "clip.avi", "--models", folder / "other.db"]


def text_database(folder: Path) -> list[object]:
    (folder / "text.db").write_text("not a database" * 100)
    return ["models", "list", folder / "text.db"]


def out_is_a_file(folder: Path) -> list[object]:
    (folder / "taken").write_text("a file")
    return ["watch", folder / "clip.avi", "--out", folder / "taken"]


def out_holds_a_run(folder: Path) -> list[object]:
    (folder / "old").mkdir()
    (folder / "old" / "journal.sqlite").write_text("an earlier run")
    return ["watch", folder / "clip.avi", "--out", folder / "old"]


def unreadable_actor(folder: Path) -> list[object]:
    return ["watch", folder / "clip.avi", "--actor", "satellite"]


def unknown_actor(folder: Path) -> list[object]:
    return ["watch", folder / "clip.avi", "--task", "dock", "--actor", "sattelite=x"]


def unknown_task(folder: Path) -> list[object]:
    return ["watch", folder / "clip.avi", "--task", "dokc"]


def bad_rules(folder: Path) -> list[object]:
    (folder / "bad.rules").write_text("rule without end")
    return ["watch", folder / "clip.avi", "--rules", folder / "bad.rules"]


def bad_behaviour(folder: Path) -> list[object]:
    (folder / "plugin.py").write_text("x = 1")
    return ["watch", folder / "clip.avi", "--behaviour", folder / "plugin.py"]


def bad_zones(folder: Path) -> list[object]:
    (folder / "bad.toml").write_text('[[zone]]\nname = "dock"\npolygon = [[0, 0], [9, 9]]\n')
    return ["watch", folder / "clip.avi", "--zones", folder / "bad.toml"]


def bad_every(folder: Path) -> list[object]:
    return ["watch", folder / "clip.avi", "--every", "0"]


def unknown_option(folder: Path) -> list[object]:
    return ["watch", folder / "clip.avi", "--no-such-option"]


def eval_of_nothing(folder: Path) -> list[object]:
    (folder / "hollow").mkdir()
    return ["eval", "missions", folder / "hollow"]


def scenario_that_is_none(folder: Path) -> list[object]:
    (folder / "x.toml").write_text("name = 3\n[camera]\nsize = 'large'\n")
    return ["render", folder / "x.toml", "--out", folder / "rendered"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (text_named_mp4, "story.mp4"),
        (missing_video, "nothing.mp4"),
        (folder_without_images, "empty"),
        (task_with_mistakes, "bad.task:2"),
        (watch_with_bad_task, "bad.task:2"),
        (foreign_database, "other.db"),
        (text_database, "text.db"),
        (out_is_a_file, "taken"),
        (out_holds_a_run, "already contains a run"),
        (unreadable_actor, "NAME=MODEL"),
        (unknown_actor, "satellite"),
        (unknown_task, "dock"),
        (bad_rules, "bad.rules:1"),
        (bad_zones, "the polygon has 2 corners"),
        (bad_behaviour, "plugin.py"),
        (bad_every, "--every"),
        (unknown_option, "--no-such-option"),
        (eval_of_nothing, "hollow"),
        (scenario_that_is_none, "x.toml"),
    ],
)
def test_bad_input_gives_one_message_and_exit_code_2(
    visup: Call, clip: Path, tmp_path: Path, make: Make, message: str
) -> None:
    result = visup(*make(tmp_path))
    assert result.code == 2, result.out + result.err
    everything = result.out + result.err
    assert message in everything.replace("\n", "") or message in everything
    assert "Traceback" not in everything


def test_three_mistakes_in_a_task_give_three_messages(visup: Call, tmp_path: Path) -> None:
    result = visup(*task_with_mistakes(tmp_path))
    everything = result.out + result.err
    assert all(f"bad.task:{line}" in everything for line in (2, 3, 4))
    assert "converging" in everything  # did you mean


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_an_output_folder_without_permission_is_reported(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    (tmp_path / "locked").mkdir(mode=0o500)
    result = visup("watch", clip, "--out", tmp_path / "locked" / "run")
    assert result.code == 2
    assert "cannot be written" in result.err


def test_a_run_writes_all_its_files(visup: Call, clip: Path, tmp_path: Path) -> None:
    result = visup("watch", clip, "--out", tmp_path / "run")
    assert result.code == 0, result.out + result.err
    assert "Verdict" in result.out.splitlines()[-1]
    for name in ("journal.sqlite", "events.jsonl", "report.html", "annotated.webm"):
        assert (tmp_path / "run" / name).stat().st_size > 0, name


def test_json_output_is_one_object_per_line_with_the_verdict_last(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    result = visup("watch", clip, "--json", "--out", tmp_path / "run", "--no-video")
    lines = [json.loads(line) for line in result.out.splitlines()]
    assert lines[-1]["kind"] == "result"
    assert lines[-1]["frames"] == 40
    assert any(e["kind"] == "entry" for e in lines[:-1])


def test_quiet_prints_only_the_report_path_and_the_verdict(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    result = visup("watch", clip, "--quiet", "--out", tmp_path / "run", "--no-video")
    assert len(result.out.splitlines()) == 2


def test_a_truncated_video_gives_a_result_with_its_problem(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    whole = clip.read_bytes()
    (tmp_path / "cut.avi").write_bytes(whole[: len(whole) * 2 // 3])
    result = visup("watch", tmp_path / "cut.avi", "--json", "--out", tmp_path / "run", "--no-video")
    last = json.loads(result.out.splitlines()[-1])
    assert 10 < last["frames"] < 40
    assert last["problem"]


def test_default_run_folders_are_numbered(visup: Call, clip: Path, tmp_path: Path) -> None:
    for folder in ("runs/clip", "runs/clip-2"):
        visup("watch", clip, "--quiet", "--no-video", "--every", "8")
        assert (tmp_path / folder / "journal.sqlite").exists()


def test_the_version_is_printed(visup: Call) -> None:
    assert visup("--version").out.startswith("visup ")


def test_the_doctor_finds_nothing_broken(visup: Call) -> None:
    result = visup("doctor")
    assert result.code == 0, result.out
    assert "broken" not in result.out


def test_the_doctor_measures_the_speed_of_this_machine() -> None:
    head, *rows = speeds(frames=6)
    assert "Frames a second" in head
    assert len(rows) == 2 + len(PRESETS)
    matches = [
        re.search(r"([\d.]+) of +([\d.]+) that it asks for: (keeps|drops)", row) for row in rows
    ]
    figures = [(float(m[1]), float(m[2]), m[3]) for m in matches if m]
    assert len(figures) == len(rows)
    assert all((possible >= wanted) == (keeps == "keeps") for possible, wanted, keeps in figures)
    assert [wanted for _, wanted, _ in figures] == [25.0, 25.0, 25.0, 25.0, 12.5, 25.0]


def test_the_doctor_checks_all_dependencies() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    bundles = {"all", "dev"}
    assert list(LIBRARIES) == [bare(name) for name in project["dependencies"]]
    assert {extra: names for extra, (_, names) in EXTRAS.items()} == {
        extra: tuple(map(bare, names)) for extra, names in extras.items() if extra not in bundles
    }


def bare(requirement: str) -> str:
    """The name of a library, without its version and extras."""
    return re.split(r"[\[>=]", requirement)[0]


@pytest.mark.parametrize("message", ["", "Unable to allocate 9 GiB"])
def test_exhausted_memory_is_reported(
    visup: Call, monkeypatch: pytest.MonkeyPatch, message: str
) -> None:
    def full() -> None:
        raise MemoryError(message)

    monkeypatch.setattr("visup.cli.check_memory", full)
    result = visup("presets")
    assert result.code == 1
    assert result.err.startswith(f"error: out of memory{message and ': '}{message}\n  hint: ")


ASKED_FROM_PYTHON = """
import visup
try:
    visup.watch("clip.mp4")
except visup.VisupError as error:
    raise SystemExit(f"error: {error}")
"""


@pytest.mark.parametrize("megabytes", [400, 600, 800, 1200])
@pytest.mark.parametrize(
    ("arguments", "code"),
    [(("-m", "visup.cli", "watch", "clip.mp4"), 2), (("-c", ASKED_FROM_PYTHON), 1)],
)
def test_too_little_memory_is_an_error_without_a_traceback(
    arguments: tuple[str, ...], code: int, megabytes: int, tmp_path: Path
) -> None:
    resource = pytest.importorskip("resource", reason="this system has no limits of memory")
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (megabytes << 20, megabytes << 20)
        ),
    )
    assert done.returncode == code, done.stderr
    assert "memory" in done.stderr
    assert "Traceback" not in done.stderr
