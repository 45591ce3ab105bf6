"""The commands are listed by name, and imported when they are called."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from visup.cli import app
from visup.commands import PURPOSES
from visup.terminal.overview import LazyCommands

ENTRIES = {name: entry for purpose in PURPOSES.values() for name, entry in purpose.items()}
MODULES_AFTER_HELP = """
import sys
from visup.cli import main
sys.argv = ["visup", {words}]
try:
    main()
finally:
    print(*sorted(m for m in sys.modules if m.startswith("visup.commands.")), file=sys.stderr)
"""


def imported(words: str) -> list[str]:
    code = MODULES_AFTER_HELP.format(words=words)
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return done.stderr.split()


def test_the_overview_imports_no_command() -> None:
    assert imported('"--help"') == []


def test_a_command_imports_no_other_group() -> None:
    told = imported('"presets", "--help"')
    assert "visup.commands.presets" in told
    assert not {"visup.commands.models", "visup.commands.eval.catalogue"} & set(told)


@pytest.mark.parametrize("name", ENTRIES)
def test_every_command_tells_its_use(name: str) -> None:
    done = CliRunner().invoke(app, [name, "--help"])
    assert done.exit_code == 0
    assert f" {name} " in done.output.splitlines()[0]
    assert "--install-completion" not in done.output
    assert "\u256d" not in done.output, "plain help, without frames"


def test_a_command_is_put_together_once() -> None:
    commands = LazyCommands(ENTRIES)
    assert list(commands) == list(ENTRIES)
    assert len(commands) == len(ENTRIES)
    assert commands["presets"] is commands["presets"]
    with pytest.raises(KeyError):
        commands["preset"]


def test_a_misspelt_command_is_answered_with_the_nearest() -> None:
    done = CliRunner().invoke(app, ["presests"])
    assert done.exit_code == 2
    assert "Did you mean 'presets'?" in done.output


def test_a_shell_completes_commands_and_their_own_commands() -> None:
    def completed(words: str) -> set[str]:
        asked = {"_VISUP_COMPLETE": "complete_bash", "COMP_WORDS": words}
        asked["COMP_CWORD"] = str(words.count(" "))
        done = CliRunner().invoke(app, [], prog_name="visup", env=asked)
        return set(done.output.split())

    assert completed("visup re") == {"render", "replay"}
    assert {"check", "learn", "simulate"} <= completed("visup task ")
