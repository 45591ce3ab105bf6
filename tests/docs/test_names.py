"""What the pages name is there: modules, classes, files, commands, links."""

from __future__ import annotations

import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from tests.paths import ROOT

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
"""History speaks of files by the names that they had on that day, and is left out."""

GROUPS = {"visup.behaviours", "visup.actions"}
"""Names of entry points, under which plug-ins are found."""

FOLDERS = ("agent", "percepts", "rules", "tasks", "visup", "docs", "examples", "tests")
PATH = re.compile(rf"(?<![\w./:-])((?:{'|'.join(FOLDERS)})/[\w./-]*\w\.?(?:\w+)?/?)")
DOTTED = re.compile(r"\bvisup(?:\.[A-Za-z_]\w*)+")
MODULE = re.compile(r"`([a-z_]\w*\.(?:py|lark|task))`")
OF_THE_READER = re.compile(r"(?:[Ss]ave (?:this|it) as|^writes) `([\w.]+)`", re.MULTILINE)
"""Files that a reader of the page makes."""


def missing_path(path: str) -> bool:
    place = ROOT / path.rstrip("/.")
    return not (place.exists() or place.with_suffix(".py").exists())


def missing_name(dotted: str) -> bool:
    """Whether no module and no attribute of a module goes by a name."""
    parts = dotted.split(".")
    for end in range(len(parts), 0, -1):
        module = ".".join(parts[:end])
        try:
            if find_spec(module) is None:
                continue
        except ModuleNotFoundError:
            continue
        found: Any = import_module(module)
        for name in parts[end:]:
            if not hasattr(found, name) and name not in getattr(found, "__annotations__", {}):
                return True
            found = getattr(found, name, None)
        return False
    return True


def names_in(text: str) -> set[str]:
    return {
        m
        for m in DOTTED.findall(text)
        if m.rpartition(".")[2] not in ("svg", "models", "service") and m not in GROUPS
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_files_and_names_on_a_page_exist(page: Path) -> None:
    text = page.read_text()
    paths = {m for m in PATH.findall(text) if missing_path(m)}
    names = {m for m in names_in(text) if missing_name(m)}
    known = {p.name for folder in FOLDERS for p in (ROOT / folder).rglob("*.*")}
    modules = {m for m in MODULE.findall(text) if m not in known}
    modules -= set(OF_THE_READER.findall(text))
    assert (paths, names, modules) == (set(), set(), set())


def test_what_is_missing_is_found_to_be_missing() -> None:
    assert missing_name("visup.agent.model.step.Stap")
    assert missing_name("visup.nowhere")
    assert not missing_name("visup.Run.verdict")
    assert missing_path("rules/nowhere.py")
    assert PATH.findall("see `rules/nowhere.py`, and ../shared/data/models") == ["rules/nowhere.py"]


def test_the_table_of_commands_names_every_command() -> None:
    from typer.main import get_command

    from visup.cli import app

    told = (ROOT / "README.md").read_text()
    commands = getattr(get_command(app), "commands")  # noqa: B009
    assert [c for c in commands if f"`visup {c}" not in told] == []


def test_the_site_has_every_page() -> None:
    text = (ROOT / "mkdocs.yml").read_text()
    pages = {p.relative_to(ROOT / "docs").as_posix() for p in (ROOT / "docs").rglob("*.md")}
    dated = {p for p in pages if p.startswith("history/2")}
    assert {p for p in pages - dated if f": {p}\n" not in text} == set()
    index = (ROOT / "docs" / "history" / "index.md").read_text()
    assert {p for p in dated if Path(p).name not in index} == set()
