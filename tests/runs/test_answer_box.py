"""Answers left in the folder of a run: taken up after the next step, once, the last word first."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.clips import moving_disc, write_clip
from tests.console.test_runs import SETTINGS, ambiguous_observations
from tests.paths import ROOT
from tests.report.scene import frame_at
from tests.runs.test_resume import BARE
from visup.agent import Frame
from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.runs.inputs.answer_box import ANSWERS, MAX_FILE_BYTES, AnswerBox, put_answer
from visup.runs.inputs.audience import Audience
from visup.runs.inputs.run_folder import fresh_folder
from visup.runs.runner import supervise
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent

SEEN = list(ambiguous_observations(24))
FRAME = frame_at(0)


def told_of(folder: Path, said: dict[int, list[str]], box_from: int = 0) -> list[tuple[int, str]]:
    """What an agent reports of answers that are put before given steps: frame and who it is."""
    agent = reasoning_agent(SETTINGS)
    box, told = None, []
    troubles: list[str] = []
    for number, seen in enumerate(SEEN):
        for name in said.get(number, ()):
            put_answer(folder, 1, name)
        step = agent.reason(seen)
        if number >= box_from:
            box = box or AnswerBox(agent, lambda: folder, troubles.append)
            box(step, FRAME)
        told += [(number, str(e.data["name"])) for e in step.events if e.kind == "answer"]
    assert troubles == []
    return told


@settings(max_examples=25, deadline=None)
@given(
    said=st.dictionaries(
        st.integers(3, 20), st.lists(st.sampled_from(["arm", "spartan"]), max_size=3), max_size=4
    )
)
def test_the_last_answer_counts_and_is_passed_on_once(
    tmp_path_factory: pytest.TempPathFactory, said: dict[int, list[str]]
) -> None:
    told = told_of(tmp_path_factory.mktemp("run"), said)
    expected: list[tuple[int, str]] = []
    for number in sorted(said):
        if said[number] and (not expected or expected[-1][1] != said[number][-1]):
            expected.append((number + 1, said[number][-1]))
    assert told == expected


def test_on_resume_new_answers_are_passed_on_and_known_ones_are_not(
    tmp_path: Path,
) -> None:
    assert told_of(tmp_path, {2: ["arm", "spartan"]}, box_from=10) == [(11, "spartan")]


@pytest.mark.parametrize("line", ["1=nobody", "what?", "\x00\xff", "=arm", "1="])
def test_an_invalid_answer_is_reported_once(tmp_path: Path, line: str) -> None:
    agent = reasoning_agent(SETTINGS)
    troubles: list[str] = []
    box = AnswerBox(agent, lambda: tmp_path, troubles.append)
    (tmp_path / ANSWERS).write_text(f"{line}\n1=arm", encoding="latin-1")
    for seen in SEEN[:5]:
        box(agent.reason(seen), FRAME)
    assert len(troubles) == 1
    assert agent.mind.answers == {}  # the last line is not whole yet
    with (tmp_path / ANSWERS).open("a") as file:
        file.write("\n")
    for seen in SEEN[5:8]:
        box(agent.reason(seen), FRAME)
    assert agent.mind.answers == {1: "arm"}


def test_an_answer_file_that_is_no_file_does_not_stop_a_run(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / ANSWERS)
    agent = reasoning_agent(SETTINGS)
    box = AnswerBox(agent, lambda: tmp_path, None)
    for seen in SEEN[:3]:
        box(agent.reason(seen), FRAME)
    box = AnswerBox(agent, lambda: None, None)
    box(agent.reason(SEEN[3]), FRAME)


def test_answers_are_single_lines_of_limited_number(tmp_path: Path) -> None:
    put_answer(tmp_path, 2, "the\n1=arm   big one")
    assert (tmp_path / ANSWERS).read_text() == "2=the 1=arm big one\n"
    with pytest.raises(SettingsError):
        put_answer(tmp_path, 2, "# nobody")
    with pytest.raises(OutputError, match="cannot be written"):
        put_answer(tmp_path / "nowhere", 2, "arm")
    (tmp_path / ANSWERS).write_text("#" * MAX_FILE_BYTES)
    with pytest.raises(OutputError, match="too many"):
        put_answer(tmp_path, 2, "arm")


def test_a_run_reads_answers_put_into_its_folder(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(30), fps=20.0)
    folder = tmp_path / "run"

    def say(step: Step, frame: Frame) -> None:
        if step.frame_index == 20:
            put_answer(folder, 1, "spartan")

    settings = WatchSettings(str(clip), models=ROOT / "visup" / "data" / "demo.models")
    supervise(settings, fresh_folder(folder, ""), audience=Audience([say]), options=BARE)
    assert list(Recording.open(folder).answers().values()) == [{1: "spartan"}]
