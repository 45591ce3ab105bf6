"""Syntax files for editors: they have every word that the grammars have, and editors take them."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from lark import Lark

from tests.paths import ROOT
from visup.rules.language.error_recovery import grammar as rules_grammar
from visup.tasks.grammar.parser import tokens
from visup.tasks.tools.syntaxes import EDITORS, SYNTAXES, Syntax

TASKS = sorted(f for d in ("tasks/shipped", "tests/tasks/good") for f in (ROOT / d).glob("*.task"))
NAMED = {"NAME", "MODEL", "STAGE", "HEAD", "TEXT", "NUMBER", "UNIT", "BARE", "COUNT", "SEVERAL"}
SAMPLE = """# a comment
<empty> ::= for each new part <take(part)>
<take(part)> ::= coupled(arm, part) for 2 s
actor part is red
"""


def words_of(text: str) -> set[str]:
    """The words of the language in a task file, as its own lexer finds them."""
    found = (str(t) for t in tokens(text) if t.type not in NAMED)
    return {w for word in found for w in word.split() if w.isalpha()}


@pytest.mark.parametrize("path", TASKS, ids=lambda p: p.stem)
def test_every_word_that_the_lexer_finds_is_coloured(path: Path) -> None:
    syntax = SYNTAXES["task"]
    assert words_of(path.read_bytes().decode("utf-8")) <= {*syntax.keywords, *syntax.constants}


def test_every_word_of_the_grammar_of_rules_is_coloured() -> None:
    syntax = SYNTAXES["rules"]
    lark = Lark(rules_grammar(), start="start", parser="lalr")
    quoted = {t.pattern.value for t in lark.terminals if t.pattern.type == "str"}
    never_names = re.search(r"NAME: /\(\?!\(([^)]*)\)", rules_grammar())
    assert never_names is not None
    words = {w for w in quoted if w.isalpha()} | set(never_names[1].split("|"))
    assert words == {*syntax.keywords, "true", "false"}


@pytest.mark.parametrize("editor", EDITORS)
@pytest.mark.parametrize("syntax", SYNTAXES.values(), ids=lambda s: s.name)
def test_every_file_has_every_word_and_unit(editor: str, syntax: Syntax) -> None:
    text = EDITORS[editor](syntax)
    assert set(re.findall(r"\w+", text)) >= {*syntax.keywords, *syntax.constants}
    assert all(unit in text.replace("\\/", "/") for unit in syntax.units)


@pytest.mark.skipif(shutil.which("vim") is None, reason="no Vim is installed")
def test_vim_colours_a_task_by_what_its_words_are(tmp_path: Path) -> None:
    (tmp_path / "visup.vim").write_text(EDITORS["vim"](SYNTAXES["task"]), "utf-8")
    (tmp_path / "sample").write_text(SAMPLE, "utf-8")
    places = {"comment": (1, 3), "stage": (2, 2), "for": (2, 13), "new": (2, 22), "call": (3, 18),
              "number": (3, 41), "unit": (3, 43), "actor": (4, 1), "red": (4, 15)}  # fmt: skip
    asked = [f"synIDattr(synID({a},{b},1),'name')" for a, b in places.values()]
    (tmp_path / "ask.vim").write_text(
        f"syntax on\nsyntax clear\nunlet! b:current_syntax\nsource {tmp_path}/visup.vim\n"
        f"call writefile([{', '.join(asked)}], '{tmp_path}/said')\nqall!\n"
    )
    command = [
        "vim",
        "-u",
        "NONE",
        "-es",
        "-S",
        str(tmp_path / "ask.vim"),
        str(tmp_path / "sample"),
    ]
    subprocess.run(command, timeout=20, check=False, stdin=subprocess.DEVNULL, capture_output=True)
    said = dict(zip(places, (tmp_path / "said").read_text().split("\n"), strict=False))
    assert said == {
        "comment": "visupComment", "stage": "visupStage", "for": "visupKeyword", "new": "visupKeyword",
        "call": "visupFunction", "number": "visupNumber", "unit": "visupNumber", "actor": "visupKeyword",
        "red": "visupConstant",
    }  # fmt: skip


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node.js is installed")
@pytest.mark.parametrize("syntax", SYNTAXES.values(), ids=lambda s: s.name)
def test_what_is_written_for_web_pages_is_a_module_whose_patterns_can_be_read(
    tmp_path: Path, syntax: Syntax
) -> None:
    (tmp_path / "visup.cjs").write_text(EDITORS["highlightjs"](syntax), "utf-8")
    script = (
        f"const l = require({str(tmp_path / 'visup.cjs')!r})();"
        "for (const m of l.contains) new RegExp(m.begin);"
        "console.log(l.name, l.keywords.keyword.length)"
    )
    told = subprocess.run(["node", "-e", script], check=True, capture_output=True, text=True)
    assert told.stdout.split() == ["visup", syntax.name, str(len(syntax.keywords))]
