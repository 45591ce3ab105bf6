"""Nothing that others wrote reaches the terminal, or the report, as a command to it."""

from __future__ import annotations

import ast
import base64
import hashlib
import io
import json
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from tests.cli import caller
from tests.paths import ROOT
from visup.terminal.console import make_console
from visup.wording import escaped_json, printable

EVIL = "\x1b[2J\x1b]0;owned\x07 arm\x9b31m \u202egnp.exe\u2066 \ud800 \r\b\x7f"
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


@given(st.text(st.characters(codec=None)))
def test_control_characters_are_removed_and_nothing_else(text: str) -> None:
    told = printable(text)
    assert not OBEYED.search(told)
    assert printable(told) == told
    left = iter(text)
    assert all(c in left for c in told)
    told.encode()  # can be printed at all


@given(st.text(st.characters(codec=None)))
def test_json_output_is_lossless(text: str) -> None:
    told = escaped_json({"text": text}, ensure_ascii=False)
    assert not OBEYED.search(told)
    assert json.loads(told) == {"text": text}


@pytest.mark.parametrize("terminal", [False, True])
def test_only_colours_of_rich_reach_the_terminal(terminal: bool) -> None:
    out = io.StringIO()
    console = make_console(file=out, force_terminal=terminal, width=200)
    table = Table(title=EVIL)
    table.add_column(EVIL)
    table.add_row(Text(EVIL, style="red"))
    for shown in (EVIL, Text(EVIL, style="bold"), table, Panel(EVIL, title="x")):
        console.print(shown, markup=False)
    told = re.sub(r"\x1b\[[0-9;]*m", "", out.getvalue())  # what rich itself says: colours
    assert not OBEYED.search(told)
    assert "arm" in told
    assert ("\x1b[" in out.getvalue()) == terminal


def test_only_the_console_module_prints() -> None:
    assert [
        f"{path.relative_to(ROOT)}:{node.lineno}: {ast.unparse(node.func)}"
        for part in ("visup", "agent", "rules", "tasks", "percepts")
        for path in (ROOT / part).rglob("*.py")
        if path.relative_to(ROOT).as_posix() not in ALLOWED
        for text in [path.read_text()]
        if MAY_PRINT.search(text)  # most files need not be parsed, which takes long
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and ast.unparse(node.func) in PRINTING
    ] == []


PRINTING = ("print", "typer.echo", "typer.secho", "click.echo", "Console", "sys.stdout.write")
MAY_PRINT = re.compile(r"\b(print|echo|secho|Console|write)\s*\(")
ALLOWED = {
    "visup/terminal/console.py",
    "visup/terminal/display.py",  # draws into a text of its own, for notebooks
    "visup/cli.py",  # the version
    "agent/storage/schema.py",  # writes the documentation
}


def test_only_scripts_of_the_report_may_run() -> None:
    pytest.importorskip("plotly", reason="the extra visup[report] is not installed")
    from tests.report.page.test_html import data
    from visup.report.page.html import report_page

    page = report_page(data())
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy is not None
    assert "script-src 'sha256-" in policy[1]
    assert "script-src 'unsafe-inline'" not in policy[1]
    scripts = re.findall(r"<script>(.*?)</script>", page, re.S)
    hashes = [base64.b64encode(hashlib.sha256(s.encode()).digest()).decode() for s in scripts]
    assert all(f"'sha256-{h}'" in policy[1] for h in hashes)


def test_a_path_that_is_not_text_is_printed(tmp_path: Path) -> None:
    assert printable(str(tmp_path) + "/\udcff").endswith("/")


@pytest.mark.parametrize(
    "words",
    [
        ("watch", "a.avi", "--every", EVIL),
        ("watch", f"--{EVIL}"),
        (EVIL,),
        ("task", EVIL),
        ("watch", f"{EVIL}.avi"),
        ("presets", EVIL),
        ("task", "check", f"{EVIL}.task"),
    ],
)
def test_refused_arguments_are_quoted_without_control_characters(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    result = caller(monkeypatch, capfd)(*(w.replace("\ud800", "") for w in words))
    assert result.code == 2
    assert result.err
    assert not OBEYED.search(result.err + result.out)
