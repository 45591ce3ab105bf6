"""The pages of a first afternoon: what they quote is said, what they show works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.paths import ROOT
from visup.cli import app
from visup.rules.language.parser import parse_rules
from visup.runs.inputs.presets import PRESETS
from visup.runs.inputs.zones import load_zones

PAGES = (
    *("troubleshooting.md", "watching-a-road.md", "which-tool.md", "your-own-cell.md"),
    *("first-task.md", "first-plugin.md", "deployment.md", "other-tools.md"),
)
TREES = [
    path.read_text(encoding="utf-8")
    for room in ("agent", "percepts", "rules", "tasks", "visup")
    for path in (ROOT / room).rglob("*.py")
]
CODE = re.sub(r'"\s*\n\s*f?"', "", "\n".join(TREES))


def page(name: str) -> str:
    return (ROOT / "docs" / name).read_text(encoding="utf-8")


def quoted() -> list[str]:
    """Messages that the table of symptoms quotes: those of several words."""
    rows = re.findall(r"^\| ([^|]*`[^|]*) \|", page("troubleshooting.md"), re.MULTILINE)
    found = [q for row in rows for q in re.findall(r"`([^`]+)`", row)]
    return [q for q in found if " " in q and not q.startswith(("visup", "--"))]


@pytest.mark.parametrize("message", quoted())
def test_every_message_that_is_quoted_is_one_that_visup_says(message: str) -> None:
    parts = re.split(r"\.\.\.|'[^']*'|\(.*\)|: |\d+", message)
    said = [p.strip() for p in parts if len(p.strip().split()) > 1]
    assert said or message.startswith("Verdict")
    assert [p for p in said if p not in CODE] == []


@pytest.mark.parametrize("name", PAGES)
def test_every_command_and_option_exists(name: str) -> None:
    commands = re.findall(r"^visup .*|`(visup [^`]+)`", page(name), re.MULTILINE)
    text = re.sub(r"<!--.*?-->", "", page(name))
    lines = [c for c in re.findall(r"`?(visup [a-z][^`\n]*)", text) if commands]
    for line in lines:
        words = line.split("#")[0].split()[1:]
        names = (
            words[:2]
            if words[0] in ("models", "task", "rules", "eval", "behaviours")
            else words[:1]
        )
        told = CliRunner().invoke(app, [*names, "--help"], env={"COLUMNS": "200"})
        if told.exit_code != 0:
            assert not re.search(r"\s--", line), line  # words of a sentence, no command
            continue
        for option in (w.partition("=")[0] for w in words if w.startswith("--")):
            assert option.rstrip(")`.,;:") in told.output, line


def test_the_rule_and_the_zone_of_the_road_are_right(tmp_path: Path) -> None:
    text = page("watching-a-road.md")
    rules = parse_rules(re.findall(r"```\n(# queue\.rules.*?)```", text, re.DOTALL)[0])
    assert [r.name for r in rules] == ["standing"]
    (tmp_path / "yard.toml").write_text(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[0])
    assert [z.name for z in load_zones(tmp_path / "yard.toml")] == ["keep_out_gate"]


def test_presets_that_are_named_exist() -> None:
    named = {p for n in PAGES for p in re.findall(r"--preset ([a-z]+)", page(n))}
    assert named
    assert named <= set(PRESETS)


@pytest.mark.parametrize("name", PAGES)
def test_links_between_pages_lead_somewhere(name: str) -> None:
    for target in re.findall(r"\]\(([^)#:]+\.md)(?:#[\w-]+)?\)", page(name)):
        assert (ROOT / "docs" / target).is_file()
    assert name in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


def anchors(path: Path) -> set[str]:
    """What the headings of a page are called in links."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    headings = re.findall(r"^#+ (.+)$", text, re.MULTILINE)
    plain = (re.sub(r"[^\w\s-]", "", h.lower()).strip() for h in headings)
    return {re.sub(r"[\s-]+", "-", h) for h in plain}


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))])
def test_links_to_headings_lead_to_headings(page: Path) -> None:
    links = re.findall(r"\]\(([^)#:]*\.md)?#([\w-]+)\)", page.read_text(encoding="utf-8"))
    assert [
        (name, anchor)
        for name, anchor in links
        if anchor not in anchors(page.parent / name if name else page)
    ] == []
