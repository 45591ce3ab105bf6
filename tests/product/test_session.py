from __future__ import annotations

import io

import pytest
from rich.console import Console

from tests.agent.scripted import Scripted, counting, frames, worried_while
from visup.agent.agent import Agent, Thinkers
from visup.session import HELP, Session


def session(count: int = 30) -> tuple[Session, io.StringIO]:
    out = io.StringIO()
    thinkers = Thinkers(update=(counting,), cogitate=(worried_while(lambda t: t > 1.0),))
    agent = Agent([Scripted("eye", ("x",))], thinkers)
    return Session(agent, frames(count), Console(file=out, width=80)), out


@pytest.mark.parametrize(
    ("commands", "frame"),
    [
        (["step"], 0),
        (["step", "step 4"], 4),
        (["step 2", "", ""], 5),
        (["run until 0.7"], 7),
        (["run until alert"], 11),
        (["run"], 29),
        (["s 3"], 2),
        (["step 5", "quit", "step 5"], 4),
    ],
)
def test_commands_move_the_agent(commands: list[str], frame: int) -> None:
    it, _ = session()
    assert it.run(commands) == 0
    assert it.agent.mind.frame_index == frame


def test_every_command_answers_before_and_after_the_first_step() -> None:
    it, out = session()
    looks = [w for w in it.words() if w not in ("until", "quit", "run", "step")]
    it.run([*looks, "step 15", *looks, "relations 1", "candidates 7", "nonsense", "r"])
    said = out.getvalue()
    assert "This is a worry." in said
    assert "'nonsense' is not a command" in said
    assert "which object?" in said
    assert "(run, regions, relations?)" in said


def test_help_names_every_command_and_fits_80_columns() -> None:
    it, _ = session()
    assert all(word in HELP for word in it.words())
    assert all(len(line) <= 80 for line in HELP.splitlines())


def test_the_end_of_the_source_is_told() -> None:
    it, out = session(3)
    it.run(["run", "step"])
    assert "the source has ended" in out.getvalue()
