"""`visup replay` and `visup watch --resume` as a user meets them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli import Call
from tests.clips import moving_disc, write_clip
from tests.commands.test_cli import visup
from visup.agent.storage.journal_reader import JOURNAL
from visup.runs.runner import fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings

__all__ = ["visup"]  # the fixture

RULE = 'rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n'


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run and its clip; only copied."""
    folder = tmp_path_factory.mktemp("recorded")
    clip = write_clip(folder / "clip.avi", moving_disc(30), fps=15.0)
    options = RunOptions(video=False)
    supervise(WatchSettings(source=str(clip)), fresh_folder(folder / "run", ""), options=options)
    clip.rename(folder / "moved.avi")  # no replay reads it
    return folder


@pytest.fixture
def run(visup: Call, recorded: Path, tmp_path: Path) -> Path:
    shutil.copytree(recorded / "run", tmp_path / "run")
    shutil.copy(recorded / "moved.avi", tmp_path / "clip.avi")
    return tmp_path / "run"


def test_a_replay_gives_the_narrative_without_the_video(visup: Call, run: Path) -> None:
    (run.parent / "clip.avi").unlink()
    result = visup("replay", run)
    assert result.code == 0
    assert "in view" in result.out
    assert "30 frames replayed in" in result.out
    assert "Verdict" in result.out


def test_a_replay_says_that_loops_cannot_be_kept(
    visup: Call, run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "compiled anew" not in visup("replay", run).out
    monkeypatch.setattr("visup.compiled._uncached", ["fit"])
    assert visup("replay", run).out.count("compiled anew") == 1


def test_the_exit_code_says_whether_anything_changes(visup: Call, run: Path) -> None:
    same = visup("replay", run, "--diff")
    assert (same.code, same.out.splitlines()[-1]) == (0, "Nothing changes.")
    rules = run.parent / "own.rules"
    rules.write_text(RULE)
    other = visup("replay", run, "--rules", rules, "--diff", "--out", run.parent / "other")
    assert other.code == 1
    assert "+ " in other.out
    assert "alerts: 0 gone, 1 new" in other.out
    assert "verdict: none -> interrupted" in other.out
    back = visup("replay", run, "--against", run.parent / "other", "--quiet")
    assert back.code == 1
    assert "alerts: 1 gone, 0 new" in back.out
    assert "- " not in back.out.replace("interrupted -> none", "")
    assert visup("replay", run.parent / "other", "--diff").code == 0
    lines = (run.parent / "other" / "events.jsonl").read_text().splitlines()
    alerts = [json.loads(e) for e in lines]
    assert [e["kind"] for e in alerts].count("alert") == 1


def test_bad_input_gives_one_message(visup: Call, run: Path) -> None:
    nothing = visup("replay", run.parent / "no-such-run")
    assert (nothing.code, "no recorded run" in nothing.err) == (2, True)
    bad = run.parent / "bad.rules"
    bad.write_text("rule")
    assert visup("replay", run, "--rules", bad).code == 2
    data = bytearray((run / JOURNAL).read_bytes())
    data[4096:30000] = bytes(30000 - 4096)
    (run / JOURNAL).write_bytes(data)
    damaged = visup("replay", run)
    assert damaged.code == 2
    assert "Traceback" not in damaged.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--resume", "run"), "is complete"),
        (("clip.avi", "--resume", "run"), "takes no source"),
        (("--resume", "run", "--fps", "5"), "takes no source"),
        (("--resume", "."), "no recorded run"),
        ((), "--resume"),
        (("clip.avi", "--sink", "tape:x"), "cannot be read"),
    ],
)
def test_invalid_resume_options_are_refused(
    visup: Call, run: Path, arguments: tuple[str, ...], message: str
) -> None:
    result = visup("watch", *arguments)
    assert result.code == 2
    assert message in result.err
