"""Thirty commands of a first afternoon, in order, in one folder: all as told."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli import Call
from tests.first_hours.test_sessions import piped
from tests.paths import ROOT

OUTLINE = "disc=8,20 40,20 40,52 8,52"

LIFT = """\
actor disc is what moves first
<cross> ::= <go>
<go> ::= moving(disc) for 0.4 s
"""
NEVER = LIFT + "never not present(disc)\n"
SLIP = LIFT.replace("moving(", "movin(")
RULES = 'rule seen(a): warning\n    when in_view(a) > 0.5 s\n    say "{a} {is} seen."\n'

COMMANDS: list[tuple[str, int, str]] = [
    # What is there?
    ("--version", 0, "visup "),
    ("doctor", 0, "numpy"),
    ("task list", 0, "dock"),
    ("rules list", 0, "collision_course"),
    ("behaviours list", 0, "motion"),
    ("presets", 0, "traffic: a road"),
    # A clip of one's own, without a task.
    ("check clip.avi", 0, "A run can start."),
    ("watch clip.avi", 0, "Verdict: nothing unsafe was seen (no task was given)"),
    ("watch clip.avi --quiet", 0, "Report:  runs/clip-2/report.html"),
    ("watch clip.avi --json --no-video", 0, '"kind": "result"'),
    ("watch clip.avi --verbose --no-video", 0, "Object 1 is in view."),
    ("watch clip.avi --preset bench --no-video --out runs/bench", 0, "Seen: 1 object."),
    ("replay runs/clip", 0, "frames replayed"),
    ("replay runs/clip --diff", 0, "Nothing changes."),
    ("export runs/clip mot", 0, "clip-mot.txt: "),
    # Slips.
    ("watch clop.avi", 2, "did you mean clip.avi?"),
    ("watch clip.avi --out runs/clip", 2, "the folder already contains a run"),
    ("watch clip.avi --every abc", 2, "'abc' is not a whole number"),
    ("watch clip.avi --task dock", 2, "cannot be followed"),
    ("watch clip.avi --task dok", 2, "did you mean"),
    # A first task.
    ("task check slip.task", 2, "did you mean"),
    ("task check cross.task", 0, ""),
    ("task show cross.task", 0, "go"),
    ("task format cross.task", 0, ""),
    ("check clip.avi --task cross.task", 0, "A run can start."),
    ("watch clip.avi --task cross.task --out runs/cross --no-video", 0, "Verdict: succeeded"),
    ("replay runs/clip --task never.task", 0, "Verdict: succeeded"),
    # Rules of one's own, on the run that is there.
    ("rules check own.rules", 0, "seen"),
    ("replay runs/clip --rules own.rules", 1, "something unsafe was seen"),
    ("rules explain runs/clip --at 1.2 --rule stale_perception", 0, "stale_perception"),
    # Looking inside.
    ("step runs/cross <- step until go; why go; show go.png", 0, "go.png: 96 x 72 pixels"),
    ("step runs/cross <- stop it", 2, "is not a command"),
    # Showing things.
    (
        f"teach clip.avi --models cell.models --outline '{OUTLINE}'",
        0,
        "cell.models has outlines of",
    ),
    ("models list cell.models", 0, "disc"),
    ("models show cell.models", 0, ""),
]


@pytest.fixture
def afternoon(visup: Call, clip: Path, tmp_path: Path) -> Iterator[Call]:
    for name, text in (("cross", LIFT), ("never", NEVER), ("slip", SLIP)):
        (tmp_path / f"{name}.task").write_text(text)
    (tmp_path / "own.rules").write_text(RULES)
    yield visup
    shutil.rmtree(tmp_path / "runs", ignore_errors=True)


def test_thirty_commands_of_a_first_afternoon_all_go_as_told(
    afternoon: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(COMMANDS) >= 30
    wrong = []
    for line, code, told in COMMANDS:
        typed, _, session = line.partition(" <- ")
        if session:
            piped(monkeypatch, *(c.strip() for c in session.split(";")))
        done = afternoon(*shlex.split(typed))
        said = done.out + done.err
        if done.code != code or told not in said:
            wrong.append(
                f"$ visup {line}\n  code {done.code}, not {code}; not told: {told!r}\n{said}"
            )
    assert wrong == [], "\n".join(wrong)


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
TOLD = re.sub(r"[`|]", " ", "\n".join(p.read_text(encoding="utf-8") for p in PAGES))
GROUPS = ("task", "rules", "behaviours", "models")


@pytest.mark.parametrize("line", [line for line, _, _ in COMMANDS])
def test_every_command_of_it_is_told_by_the_readme_or_a_page(line: str) -> None:
    typed, _, session = line.partition(" <- ")
    words = shlex.split(typed)
    name = " ".join(words[: 2 if words[0] in GROUPS else 1])
    assert f"visup {name}" in TOLD or any(
        f" {words[1]}" in row for row in re.findall(rf"visup {words[0]} .*", TOLD)
    )
    assert all(w in TOLD for w in words if w.startswith("--"))
    asked = [c.split()[0] for c in session.split(";") if c.strip()]
    stepping = (ROOT / "docs" / "stepping.md").read_text(encoding="utf-8")
    assert all(c in stepping for c in asked)
