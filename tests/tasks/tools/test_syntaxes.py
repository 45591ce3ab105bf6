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


def keywords_of(text: str) -> set[str]:
    """The words of the language in a task file, as its own lexer finds them."""
    texts = (str(t) for t in tokens(text) if t.type not in NAMED)
    return {w for word in texts for w in word.split() if w.isalpha()}


@pytest.mark.parametrize("path", TASKS, ids=lambda p: p.stem)
def test_every_keyword_of_tasks_is_highlighted(path: Path) -> None:
    syntax = SYNTAXES["task"]
    assert keywords_of(path.read_bytes().decode("utf-8")) <= {*syntax.keywords, *syntax.constants}


def test_every_keyword_of_rules_is_highlighted() -> None:
    syntax = SYNTAXES["rules"]
    lark = Lark(rules_grammar(), start="start", parser="lalr")
    quoted = {t.pattern.value for t in lark.terminals if t.pattern.type == "str"}
    never_names = re.search(r"NAME: /\(\?!\(([^)]*)\)", rules_grammar())
    assert never_names is not None
    words = {w for w in quoted if w.isalpha()} | set(never_names[1].split("|"))
    assert words == {*syntax.keywords, "true", "false"}


@pytest.mark.parametrize("editor", EDITORS)
@pytest.mark.parametrize("syntax", SYNTAXES.values(), ids=lambda s: s.name)
def test_every_syntax_file_has_all_keywords_and_units(editor: str, syntax: Syntax) -> None:
    text = EDITORS[editor](syntax)
    assert set(re.findall(r"\w+", text)) >= {*syntax.keywords, *syntax.constants}
    assert all(unit in text.replace("\\/", "/") for unit in syntax.units)


@pytest.mark.skipif(shutil.which("vim") is None, reason="no Vim is installed")
def test_vim_highlights_each_kind_of_word(tmp_path: Path) -> None:
    (tmp_path / "visup.vim").write_text(EDITORS["vim"](SYNTAXES["task"]), "utf-8")
    (tmp_path / "sample").write_text(SAMPLE, "utf-8")
    positions = {"comment": (1, 3), "stage": (2, 2), "for": (2, 13), "new": (2, 22), "call": (3, 18),
              "number": (3, 41), "unit": (3, 43), "actor": (4, 1), "red": (4, 15)}  # fmt: skip
    queries = [f"synIDattr(synID({a},{b},1),'name')" for a, b in positions.values()]
    (tmp_path / "ask.vim").write_text(
        f"syntax on\nsyntax clear\nunlet! b:current_syntax\nsource {tmp_path}/visup.vim\n"
        f"call writefile([{', '.join(queries)}], '{tmp_path}/said')\nqall!\n"
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
    groups = dict(zip(positions, (tmp_path / "said").read_text().split("\n"), strict=False))
    assert groups == {
        "comment": "visupComment", "stage": "visupStage", "for": "visupKeyword", "new": "visupKeyword",
        "call": "visupFunction", "number": "visupNumber", "unit": "visupNumber", "actor": "visupKeyword",
        "red": "visupConstant",
    }  # fmt: skip


@pytest.mark.skipif(shutil.which("node") is None, reason="no Node.js is installed")
@pytest.mark.parametrize("syntax", SYNTAXES.values(), ids=lambda s: s.name)
def test_the_highlightjs_file_is_a_valid_module(tmp_path: Path, syntax: Syntax) -> None:
    (tmp_path / "visup.cjs").write_text(EDITORS["highlightjs"](syntax), "utf-8")
    script = (
        f"const l = require({str(tmp_path / 'visup.cjs')!r})();"
        "for (const m of l.contains) new RegExp(m.begin);"
        "console.log(l.name, l.keywords.keyword.length)"
    )
    done = subprocess.run(["node", "-e", script], check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["visup", syntax.name, str(len(syntax.keywords))]
