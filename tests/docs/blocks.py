"""The code blocks of the pages: what each is, and whether it is excused from being run."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tests.paths import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
FENCED = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*?) -->\n+)?^(?P<indent> *)```(?P<language>\w*)\n(?P<text>.*?)^ *```$",
    re.MULTILINE | re.DOTALL,
)
DECLARED = re.compile(r"::=|^(optional )?actor |^bystander|^zone |^never |^always ", re.MULTILINE)
COMMANDS = ("visup", "make", "pip", "git", "cd", "printf", "python", "sqlite3")


@dataclass(frozen=True)
class Block:
    """One fenced block.

    Attributes:
        page: Where it stands.
        line: Number of its first line.
        language: As it is marked, or empty.
        text: What it holds.
        mark: What the comment before it says, or empty.
    """

    page: Path
    line: int
    language: str
    text: str
    mark: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def kind(self) -> str:
        """What is done with it: `python`, `toml`, `shell`, `task`, `rules`, or `output` (nothing)."""
        if self.language in ("python", "toml", "json"):
            return self.language
        lines = [x for x in self.text.splitlines() if x.strip()]
        typed = [x.removeprefix("$ ") for x in lines if not x.startswith(("#", " "))]
        if (
            self.language == "console"
            or self.text.startswith("$ ")
            or (typed and all(_is_command(x) for x in typed))
        ):
            return "shell"
        if DECLARED.search(self.text) and "^" not in self.text:
            return "task"
        return "rules" if re.search(r"^rule \w+\(", self.text, re.MULTILINE) else "output"


def _is_command(line: str) -> bool:
    return line.partition(" ")[0] in COMMANDS


def blocks() -> list[Block]:
    """All blocks of all pages."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for m in FENCED.finditer(text):
            line = text.count("\n", 0, m.start("text"))
            found.append(Block(page, line, m["language"], m["text"], m["mark"] or ""))
    return found


def typed_lines(text: str) -> list[str]:
    """The commands of a block of shell, each in a line, without prompts, comments, and what is answered."""
    joined = re.sub(r"\\\n\s*", "", text)
    lines = (x.removeprefix("$ ") for x in joined.splitlines())
    return [re.sub(r"(^|\s)#.*", "", x).rstrip() for x in lines if _is_command(x)]
