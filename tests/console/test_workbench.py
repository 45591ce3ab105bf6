"""Texts written in the page are checked, completed and saved; no other file is touched."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from visup.agent import Zone
from visup.agent.model.errors import VisupError
from visup.console.workbench.drafts import DraftKind, check_draft, completion_prefix, completions_at
from visup.console.workbench.saving import SUFFIXES, save_draft
from visup.runs.inputs.zones import area, load_zones, read_zones, zones_text

TASK = "<go> ::= <near>\n<near> ::= converging(arm, satellite)\n"
RULES = 'rule close(a, b): warning\n    when touching(a, b)\n    say "{a} {is} close to {b}."\n'
ZONES = '[[zone]]\nname = "dock"\npolygon = [[0, 0], [90, 0], [90, 80]]\n'

numbers = st.floats(-5000, 5000, allow_nan=False)
corners = st.lists(st.tuples(numbers, numbers), min_size=3, max_size=6).map(tuple)


@given(corners, st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True))
def test_a_drawn_zone_is_read_back_unchanged(
    polygon: tuple[tuple[float, float], ...], name: str
) -> None:
    assume(area(polygon) >= 1.0)  # a line is no zone
    (read,) = read_zones(zones_text([Zone(name, polygon)]), "zones")
    assert (read.name, read.polygon) == (name, polygon)


def test_zones_with_depth_are_read_back_unchanged(tmp_path: Path) -> None:
    zones = read_zones(f"{ZONES}depth = [1.5, 4]\n\n{ZONES.replace('dock', 'yard')}", "zones")
    (tmp_path / "a.toml").write_text(zones_text(zones))
    assert load_zones(tmp_path / "a.toml") == zones


@pytest.mark.parametrize(
    ("kind", "text", "line"),
    [
        ("task", "<go> ::= convrging(arm, satellite)", 1),
        ("task", "<go> ::= <near>\n<near> ::= nonsense", 2),
        ("task", "include '/etc/passwd'\n<a> ::= converging(b, c)", 1),
        ("rules", RULES.replace("touching", "touchng"), 2),
        ("rules", "nonsense", 1),
        ("zones", "[[zone]]\nname = 3", 0),
        ("zones", "[[zone", 0),
        ("zones", ZONES.replace("[90, 80]", "[50, 0]"), 0),
        ("task", "x" * 200_000, 0),
    ],
)
def test_mistakes_are_reported_with_their_lines(kind: str, text: str, line: int) -> None:
    found = check_draft(DraftKind(kind), text)
    assert found.faults
    assert found.faults[0].line == line
    assert "root:" not in str(found.faults)
    assert not found.tree


@pytest.mark.parametrize("kind", list(DraftKind))
def test_correct_texts_have_an_outline_and_empty_ones_no_mistakes(kind: DraftKind) -> None:
    text = {DraftKind.TASK: TASK, DraftKind.RULES: RULES, DraftKind.ZONES: ZONES}[kind]
    found = check_draft(kind, text)
    assert not found.faults
    assert found.tree
    assert [z.name for z in found.zones] == (["dock"] if kind is DraftKind.ZONES else [])
    assert check_draft(kind, " \n") == check_draft(kind, "")
    assert not check_draft(kind, "").faults


def test_completions_fit_the_typed_prefix() -> None:
    offset = TASK.index("<near>") + 1
    assert [w.text for w in completions_at(DraftKind.TASK, TASK, offset)] == ["go", "near"]
    offset = TASK.index("converging") + 4
    assert "converging" in [w.text for w in completions_at(DraftKind.TASK, TASK, offset)]
    assert {w.text for w in completions_at(DraftKind.RULES, "rule a: when touc", 17)} == {
        "touching"
    }
    assert completions_at(DraftKind.ZONES, "[[zo", 4) == []


@given(st.text(max_size=20))
def test_the_completion_prefix_is_the_end_of_the_text(text: str) -> None:
    word = completion_prefix(text)
    assert text.endswith(word)
    assert completion_prefix(f"{text} ") == ""


@pytest.mark.parametrize("kind", list(DraftKind))
def test_only_texts_without_mistakes_are_saved_and_none_is_overwritten(
    tmp_path: Path, kind: DraftKind
) -> None:
    text = {DraftKind.TASK: TASK, DraftKind.RULES: RULES, DraftKind.ZONES: ZONES}[kind]
    path = save_draft(tmp_path, kind, "mine", text, replace=False)
    assert path == tmp_path / f"mine{SUFFIXES[kind]}"
    assert path.read_text() == text
    with pytest.raises(VisupError, match="already"):
        save_draft(tmp_path, kind, "mine", text, replace=False)
    save_draft(tmp_path, kind, "mine", f"{text}\n", replace=True)
    with pytest.raises(VisupError, match="mistakes"):
        save_draft(tmp_path, kind, "other", "nonsense [", replace=False)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    "name", ["", "..", "../a", "a/b", "/etc/x", "a.task", ".hidden", "a\0", "x" * 80, "ä", "a b"]
)
def test_names_with_paths_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(VisupError, match="no name"):
        save_draft(tmp_path, DraftKind.TASK, name, TASK, replace=True)
    assert list(tmp_path.iterdir()) == []


def test_links_are_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "into").mkdir()
    (tmp_path / "victim").write_text("mine")
    (tmp_path / "into" / "a.task").symlink_to(tmp_path / "victim")
    with pytest.raises(VisupError):
        save_draft(tmp_path / "into", DraftKind.TASK, "a", TASK, replace=True)
    assert (tmp_path / "victim").read_text() == "mine"
