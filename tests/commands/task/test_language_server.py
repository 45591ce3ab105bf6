"""The language server, spoken to over stdin and stdout as editors do."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pygls", reason="the extra `lsp` is not installed")

TEXT = """# a task
actor satellite is spartan or hubble
<dock>     ::= <approach> <captured>
<approach> ::= converging(arm, satellite)
<captured> ::= coupled(arm, satellite)
"""


class Editor:
    """As much of an editor as a server needs to see."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "visup.cli", "task", "lsp"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.number = 0
        self.told: dict[str, list[dict[str, Any]]] = {}
        self.ask("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
        self.tell("initialized", {})

    def send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self.process.stdin
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.process.stdin.flush()

    def receive(self) -> dict[str, Any]:
        assert self.process.stdout
        length = 0
        while (line := self.process.stdout.readline().strip()) != b"":
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        message: dict[str, Any] = json.loads(self.process.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            self.told[message["params"]["uri"]] = message["params"]["diagnostics"]
        return message

    def tell(self, method: str, params: dict[str, Any]) -> None:
        self.send({"method": method, "params": params})

    def ask(self, method: str, params: Any) -> Any:
        self.number += 1
        self.send({"id": self.number, "method": method, "params": params})
        while (answer := self.receive()).get("id") != self.number:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def at(self, kind: str, uri: str, line: int, character: int, **more: Any) -> Any:
        place = {"line": line, "character": character}
        about = {"textDocument": {"uri": uri}, "position": place, **more}
        return self.ask(f"textDocument/{kind}", about)

    def write(self, path: Path, text: str) -> str:
        path.write_text(text, encoding="utf-8")
        uri = path.as_uri()
        document = {"uri": uri, "languageId": "visup-task", "version": 1, "text": text}
        self.tell("textDocument/didOpen", {"textDocument": document})
        self.at("hover", uri, 0, 0)  # an answer comes after what was told before
        return uri

    def change(self, uri: str, text: str) -> None:
        document = {"uri": uri, "version": 2}
        self.tell(
            "textDocument/didChange",
            {"textDocument": document, "contentChanges": [{"text": text}]},
        )
        self.at("hover", uri, 0, 0)


@pytest.fixture(scope="module")
def editor() -> Iterator[Editor]:
    opened = Editor()
    yield opened
    opened.ask("shutdown", None)
    opened.tell("exit", {})
    with opened.process as process:
        assert process.wait(10) == 0


def test_mistakes_are_shown_as_one_types_and_go_when_they_are_mended(
    editor: Editor, tmp_path: Path
) -> None:
    uri = editor.write(
        tmp_path / "a.task", TEXT.replace("coupled(", "cupled(").replace("::= <a", ":= <a")
    )
    wrong, unknown = editor.told[uri]
    assert (wrong["code"], unknown["code"]) == ("E102", "E201")
    assert unknown["range"] == {
        "start": {"line": 4, "character": 15},
        "end": {"line": 4, "character": 21},
    }
    assert "did you mean `coupled`?" in unknown["message"]
    editor.change(uri, TEXT)
    assert editor.told[uri] == []


def test_positions_count_as_the_editor_counts(editor: Editor, tmp_path: Path) -> None:
    # Editors count in UTF-16 units unless they say otherwise: the satellite counts two.
    uri = editor.write(tmp_path / "b.task", '<t> ::= "\U0001f6f0 holds" cupled(arm, satellite)')
    (fault,) = editor.told[uri]
    assert fault["range"]["start"]["character"] == 19
    assert fault["range"]["end"]["character"] == 25


def test_words_are_completed_by_where_they_stand(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(
        tmp_path / "c.task", TEXT + "<more> ::= <\n<next> ::= con\nnever touching(\n"
    )
    assert {i["label"] for i in editor.at("completion", uri, 5, 12)} >= {"approach", "captured"}
    items = {i["label"]: i for i in editor.at("completion", uri, 6, 14)}
    assert "they draw nearer" in items["converging"]["detail"]
    assert {"gap", "within", "<dock>"} <= set(items)
    assert {i["label"] for i in editor.at("completion", uri, 7, 15)} == {"arm", "satellite"}


def test_names_are_explained_and_lead_to_where_they_are_defined(
    editor: Editor, tmp_path: Path
) -> None:
    (tmp_path / "common.task").write_text("\n<hold> ::= coupled(arm, satellite)\n")
    uri = editor.write(
        tmp_path / "d.task",
        TEXT.replace("<captured>\n", "<captured> <hold>\n") + 'include "common.task"\n',
    )
    assert "`converging(a, b)`" in editor.at("hover", uri, 3, 18)["contents"]["value"]
    assert "coupled(arm, satellite)" in editor.at("hover", uri, 2, 28)["contents"]["value"]
    assert "spartan or hubble" in editor.at("hover", uri, 3, 34)["contents"]["value"]
    assert editor.at("definition", uri, 2, 18)["range"]["start"]["line"] == 3
    assert editor.at("definition", uri, 4, 30)["range"]["start"] == {"line": 1, "character": 6}
    there = editor.at("definition", uri, 2, 39)
    assert there["uri"].endswith("common.task")
    assert there["range"]["start"]["line"] == 1
    assert editor.at("definition", uri, 5, 12)["uri"].endswith("common.task")
    assert editor.at("hover", uri, 0, 3) is None


def test_files_are_laid_out_and_names_changed_everywhere(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "e.task", TEXT.replace("(arm, ", "(arm ,"))
    options = {"tabSize": 4, "insertSpaces": True}
    asked = {"textDocument": {"uri": uri}, "options": options}
    (edit,) = editor.ask("textDocument/formatting", asked)
    assert edit["newText"] == TEXT
    renamed = editor.at("rename", uri, 2, 18, newName="near")["changes"][uri]
    assert [(e["range"]["start"]["line"], e["newText"]) for e in renamed] == [
        (2, "near"),
        (3, "near"),
    ]
    renamed = editor.at("rename", uri, 3, 33, newName="spacecraft")["changes"][uri]
    assert [e["range"]["start"]["line"] for e in renamed] == [1, 3, 4]
    assert editor.at("rename", uri, 3, 20, newName="x") is None  # an action is not ours to rename
    editor.change(uri, "<t> ::= (")
    assert editor.ask("textDocument/formatting", asked) == []
