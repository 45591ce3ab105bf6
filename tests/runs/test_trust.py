"""What a run folder may make visup do: nothing but to read it. And who may write it: one at a time."""

from __future__ import annotations

import shlex
import threading
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from tests.runs.test_resume import BARE, Pulled, broken_run
from visup.agent import Frame
from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings

PLUG_IN = """
from pathlib import Path
from visup.agent import Contract

Path({mark!r}).touch()


class Lamp:
    contract = Contract("lamp", gives=("lamp",))

    def perceive(self, frame, seen, directives):
        return ()
"""


@pytest.fixture
def clip(tmp_path: Path) -> WatchSettings:
    return WatchSettings(source=str(write_clip(tmp_path / "disc.avi", moving_disc(12), fps=20.0)))


def written(journal: Path, **facts: object) -> None:
    """Change what a journal says of its run, as a stranger may."""
    import json
    import sqlite3

    db = sqlite3.connect(journal)
    (text,) = db.execute("SELECT value FROM run WHERE key = 'settings'").fetchone()
    row = (json.dumps({**json.loads(text), **facts}),)
    db.execute("UPDATE run SET value = ? WHERE key = 'settings'", row)
    db.commit()
    db.close()


@pytest.mark.parametrize("named", [{"behaviours": ["{file}"]}, {"plugins": ["shape"]}])
def test_code_named_in_a_run_folder_is_not_run(
    clip: WatchSettings, tmp_path: Path, named: dict[str, list[str]]
) -> None:
    mark, file = tmp_path / "it ran", tmp_path / "lamp.py"
    file.write_text(PLUG_IN.format(mark=str(mark)))
    broken_run(clip, tmp_path / "run", 5, RunOptions(video=False, report=False, state_every_s=0))
    named = {kind: [n.format(file=file) for n in names] for kind, names in named.items()}
    written(tmp_path / "run" / JOURNAL, **named)
    with pytest.raises(SettingsError, match="code is never run") as refused:
        interrupted_run(tmp_path / "run")
    assert not mark.exists()
    assert all(name in (refused.value.hint or "") for names in named.values() for name in names)


def test_hints_with_commands_are_quoted(clip: WatchSettings, tmp_path: Path) -> None:
    broken_run(clip, tmp_path / "run", 5, RunOptions(video=False, report=False, state_every_s=0))
    written(tmp_path / "run" / JOURNAL, behaviours=["a.py; touch owned"], plugins=["$(id)"])
    with pytest.raises(SettingsError) as refused:
        interrupted_run(tmp_path / "run")
    words = shlex.split((refused.value.hint or "").partition("again: ")[2])
    assert words[-4:] == ["--behaviour", "a.py; touch owned", "--plugin", "$(id)"]


def test_code_runs_once_it_is_named_again_even_if_it_has_moved(
    clip: WatchSettings, tmp_path: Path
) -> None:
    mark, file = tmp_path / "it ran", tmp_path / "lamp.py"
    broken_run(clip, tmp_path / "run", 5, RunOptions(video=False, report=False, state_every_s=0))
    written(tmp_path / "run" / JOURNAL, behaviours=["/somewhere/else/lamp.py"])
    file.write_text(PLUG_IN.format(mark=str(mark)))
    past = interrupted_run(tmp_path / "run", behaviours=(file,))
    assert supervise(past.settings, tmp_path / "run", options=BARE, past=past).steps == 12
    assert mark.exists()


def test_code_that_differs_from_the_run_is_refused(clip: WatchSettings, tmp_path: Path) -> None:
    broken_run(clip, tmp_path / "run", 5, RunOptions(video=False, report=False, state_every_s=0))
    with pytest.raises(SettingsError, match="no custom behaviours"):
        interrupted_run(tmp_path / "run", plugins=("shape",))


def test_a_live_run_is_not_resumed_and_loses_nothing(clip: WatchSettings, tmp_path: Path) -> None:
    refused = []

    def meanwhile(step: Step, frame: Frame) -> None:
        if step.frame_index == 6:
            past = interrupted_run(tmp_path / "run")
            with pytest.raises(OutputError, match="another visup is writing this run") as told:
                supervise(past.settings, tmp_path / "run", options=BARE, past=past)
            refused.append(told)

    folder = fresh_folder(tmp_path / "run", "")
    supervise(clip, folder, audience=Audience([meanwhile]), options=BARE)
    assert refused
    run = Recording.open(folder)
    assert (run.count(), run.facts()["ended"]) == (12, "complete")


def test_a_run_resumed_by_another_process_is_refused(clip: WatchSettings, tmp_path: Path) -> None:
    broken_run(clip, tmp_path / "run", 5, RunOptions(video=False, report=False, state_every_s=0))
    first, second = interrupted_run(tmp_path / "run"), interrupted_run(tmp_path / "run")
    supervise(first.settings, tmp_path / "run", options=BARE, past=first)
    with pytest.raises(OutputError, match="resumed this run in the meantime"):
        supervise(second.settings, tmp_path / "run", options=BARE, past=second)
    assert Recording.open(tmp_path / "run").facts()["ended"] == "complete"


def test_a_second_run_into_a_folder_is_refused_with_a_reason(
    clip: WatchSettings, tmp_path: Path
) -> None:
    folder = fresh_folder(tmp_path / "run", "")
    journal = Journal(folder / JOURNAL)
    with pytest.raises(OutputError, match="another visup is writing this run"):
        supervise(clip, folder, options=BARE)
    with pytest.raises(OutputError, match="another visup is writing this run"):
        fresh_folder(folder, "")
    journal.close()
    with pytest.raises(OutputError, match="already contains a run"):
        fresh_folder(folder, "")
    with pytest.raises(OutputError, match="a run is already recorded here"):
        supervise(clip, folder, options=BARE)


def test_concurrent_runs_have_their_own_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found: list[Path] = []
    begin = threading.Barrier(8)

    def start() -> None:
        begin.wait()
        found.append(fresh_folder(None, "clip.mp4"))

    threads = [threading.Thread(target=start) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(found)) == 8


def test_a_killed_writer_leaves_no_lock(clip: WatchSettings, tmp_path: Path) -> None:
    import os
    import signal

    folder = tmp_path / "run"
    folder.mkdir()
    child = os.fork()
    if child == 0:
        Journal(folder / JOURNAL)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    Journal(folder / JOURNAL, resume=True).close()


def test_a_power_failure_releases_the_folder(clip: WatchSettings, tmp_path: Path) -> None:
    def pull(step: Step, frame: Frame) -> None:
        raise Pulled

    folder = fresh_folder(tmp_path / "run", "")
    with pytest.raises(Pulled):
        supervise(clip, folder, audience=Audience([pull]), options=BARE)
    past = interrupted_run(folder)
    assert supervise(past.settings, folder, options=BARE, past=past).steps == 12


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a = " + "1" * 10_400], ids=["deep", "long"])
def test_extreme_toml_is_refused_with_a_message(tmp_path: Path, text: str) -> None:
    from visup.agent.plugins.settings import read_settings
    from visup.runs.inputs.zones import load_zones

    (tmp_path / "a.toml").write_text(text)
    for read in (load_zones, read_settings):
        with pytest.raises(SettingsError, match="not TOML"):
            read(tmp_path / "a.toml")


def test_an_answer_about_an_object_of_ten_thousand_digits_is_refused() -> None:
    from visup.runs.operator import parse_answers

    with pytest.raises(SettingsError, match="cannot be read"):
        parse_answers(["1" * 10_400 + "=arm"])
