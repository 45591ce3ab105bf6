"""Every code block of the pages is run, parsed or looked up; one that is not says why."""

from __future__ import annotations

import importlib.util
import json
import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import click
import pytest

import visup
from tests.clips import moving_disc, write_clip
from tests.docs.blocks import Block, blocks, typed_lines
from tests.paths import ROOT
from visup.cli import command as visup_command
from visup.rules.language.parser import parse_rules
from visup.runs.demo import demo_settings
from visup.tasks.grammar.parser import read

BLOCKS = blocks()
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
TARGETS = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def of(kind: str) -> list[Block]:
    return [b for b in BLOCKS if b.kind == kind and not b.mark]


def test_there_are_many() -> None:
    kinds = {k: len(of(k)) for k in ("python", "toml", "shell", "task", "rules")}
    assert kinds["python"] > 10
    assert kinds["shell"] > 25
    assert kinds["task"] > 15
    assert min(kinds.values()) >= 2


@pytest.mark.parametrize("block", [b for b in BLOCKS if b.mark], ids=str)
def test_what_is_excused_says_why_or_who_runs_it(block: Block) -> None:
    kind, _, said = block.mark.partition(": ")
    assert kind in ("not run", "run by"), "write `not run: WHY` or `run by: TEST FILE`"
    if kind == "not run":
        assert len(said.split()) >= 4, "say why it cannot be run"
    else:
        assert block.page.name in (ROOT / said).read_text(encoding="utf-8")


def test_what_is_no_code_says_who_looks_at_it() -> None:
    """Mark it by a comment before it: `<!-- run by: TEST FILE -->` or `<!-- not run: WHY -->`."""
    assert [str(b) for b in of("output")] == []


@pytest.mark.parametrize("block", of("task"), ids=str)
def test_a_task_is_in_the_language(block: Block) -> None:
    assert read(block.text)


@pytest.mark.parametrize("block", of("rules"), ids=str)
def test_rules_are_in_the_language(block: Block) -> None:
    assert parse_rules(block.text)


@pytest.mark.parametrize("block", [*of("toml"), *of("json")], ids=str)
def test_data_can_be_read(block: Block) -> None:
    assert tomllib.loads(block.text) if block.kind == "toml" else json.loads(block.text)


@pytest.mark.parametrize("block", of("shell"), ids=str)
def test_every_command_exists_with_its_options(block: Block) -> None:
    lines = typed_lines(block.text)
    assert lines
    for line in lines:
        for part in re.split(r"\s(?:&&|\|)\s", line):
            _look_up(part.strip(), block)


def _look_up(line: str, block: Block) -> None:
    words = shlex.split(line)
    name, rest = words[0], words[1:]
    if name == "visup":
        _look_up_visup(rest, f"{block}: {line}")
    elif name == "make":
        assert set(rest) <= TARGETS, line
    elif name == "pip":
        asked = [x for w in rest for x in re.findall(r"\[([\w,]+)\]", w)]
        assert {e for x in asked for e in x.split(",")} <= set(EXTRAS), line
    elif name == "python" and rest[0] == "-m":
        assert importlib.util.find_spec(rest[1]) is not None, line


def _look_up_visup(words: list[str], where: str) -> None:
    command: Any = visup_command()
    while isinstance(command, click.Group) or hasattr(command, "commands"):
        if not words or words[0].startswith("-"):
            break
        if words[0] not in command.commands and hasattr(command, "default_command"):
            words = [command.default_command, *words]
        assert words[0] in command.commands, where
        command, words = command.commands[words[0]], words[1:]
    options = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
    options |= {"--help", "--version", "--install-completion"}
    assert {w.partition("=")[0] for w in words if w.startswith("--")} <= options, where


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the pages speak of: a clip, models, a recorded run."""
    folder = tmp_path_factory.mktemp("pages")
    write_clip(folder / "clip.mp4", moving_disc(12))
    shutil.copy(str(demo_settings().models), folder / "things.models")
    visup.watch(folder / "clip.mp4", out=folder / "demo-run").finish()
    return folder


@pytest.fixture
def at_bench(bench: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copytree(bench, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


PROGRAMS = {
    page: [b for b in of("python") if b.page == page] for page in {b.page for b in of("python")}
}


@pytest.mark.parametrize("page", sorted(PROGRAMS), ids=lambda p: p.name)
def test_the_programs_of_a_page_run_one_after_the_other(page: Path, at_bench: Path) -> None:
    names: dict[str, Any] = {"__name__": "page", "visup": visup}
    for block in PROGRAMS[page]:
        exec(compile(block.text, str(block), "exec"), names)
