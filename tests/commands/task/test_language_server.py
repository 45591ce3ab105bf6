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
    """The part of an editor that the server talks to."""

    def __init__(self) -> None:
        command = [sys.executable, "-m", "visup.cli", "task", "lsp"]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.number = 0
        self.diagnostics: dict[str, list[dict[str, Any]]] = {}
        self.request("initialize", {"processId": None, "rootUri": None, "capabilities": {}})
        self.notify("initialized", {})

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
            self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        return message

    def notify(self, method: str, params: dict[str, Any]) -> None:
        self.send({"method": method, "params": params})

    def request(self, method: str, params: Any) -> Any:
        self.number += 1
        self.send({"id": self.number, "method": method, "params": params})
        while (answer := self.receive()).get("id") != self.number:
            pass
        if "error" in answer:
            raise AssertionError(answer)
        return answer["result"]

    def rename_refusal(self, uri: str, line: int, character: int, new: str) -> str:
        """The reason why a rename is refused."""
        with pytest.raises(AssertionError) as caught:
            self.request_at("rename", uri, line, character, newName=new)
        (answer,) = caught.value.args
        assert answer["error"]["code"] == -32803  # the request was valid, but failed
        return str(answer["error"]["message"])

    def request_at(self, kind: str, uri: str, line: int, character: int, **parameters: Any) -> Any:
        position = {"line": line, "character": character}
        arguments = {"textDocument": {"uri": uri}, "position": position, **parameters}
        return self.request(f"textDocument/{kind}", arguments)

    def write(self, path: Path, text: str) -> str:
        path.write_text(text, encoding="utf-8")
        uri = path.as_uri()
        document = {"uri": uri, "languageId": "visup-task", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": document})
        self.request_at("hover", uri, 0, 0)  # the answer comes after earlier notifications
        return uri

    def change(self, uri: str, text: str) -> None:
        document = {"uri": uri, "version": 2}
        self.notify(
            "textDocument/didChange",
            {"textDocument": document, "contentChanges": [{"text": text}]},
        )
        self.request_at("hover", uri, 0, 0)


@pytest.fixture(scope="module")
def editor() -> Iterator[Editor]:
    opened = Editor()
    yield opened
    opened.request("shutdown", None)
    opened.notify("exit", {})
    with opened.process as process:
        assert process.wait(10) == 0


def test_diagnostics_follow_the_text(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(
        tmp_path / "a.task", TEXT.replace("coupled(", "cupled(").replace("::= <a", ":= <a")
    )
    wrong, unknown = editor.diagnostics[uri]
    assert (wrong["code"], unknown["code"]) == ("E102", "E201")
    assert unknown["range"] == {
        "start": {"line": 4, "character": 15},
        "end": {"line": 4, "character": 21},
    }
    assert "did you mean `coupled`?" in unknown["message"]
    editor.change(uri, TEXT)
    assert editor.diagnostics[uri] == []


def test_positions_are_in_the_units_of_the_editor(editor: Editor, tmp_path: Path) -> None:
    # Editors count in UTF-16 units unless they say otherwise: the satellite counts two.
    uri = editor.write(tmp_path / "b.task", '<t> ::= "\U0001f6f0 holds" cupled(arm, satellite)')
    (diagnostic,) = editor.diagnostics[uri]
    assert diagnostic["range"]["start"]["character"] == 19
    assert diagnostic["range"]["end"]["character"] == 25


def test_completions_depend_on_the_context(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(
        tmp_path / "c.task", TEXT + "<more> ::= <\n<next> ::= con\nnever touching(\n"
    )
    assert {i["label"] for i in editor.request_at("completion", uri, 5, 12)} >= {
        "approach",
        "captured",
    }
    items = {i["label"]: i for i in editor.request_at("completion", uri, 6, 14)}
    assert "they draw nearer" in items["converging"]["detail"]
    assert {"gap", "within", "<dock>"} <= set(items)
    assert {i["label"] for i in editor.request_at("completion", uri, 7, 15)} == {"arm", "satellite"}


def test_names_have_hover_texts_and_definitions(editor: Editor, tmp_path: Path) -> None:
    (tmp_path / "common.task").write_text("\n<hold> ::= coupled(arm, satellite)\n")
    uri = editor.write(
        tmp_path / "d.task",
        TEXT.replace("<captured>\n", "<captured> <hold>\n") + 'include "common.task"\n',
    )
    assert "`converging(a, b)`" in editor.request_at("hover", uri, 3, 18)["contents"]["value"]
    assert "coupled(arm, satellite)" in editor.request_at("hover", uri, 2, 28)["contents"]["value"]
    assert "spartan or hubble" in editor.request_at("hover", uri, 3, 34)["contents"]["value"]
    assert editor.request_at("definition", uri, 2, 18)["range"]["start"]["line"] == 3
    assert editor.request_at("definition", uri, 4, 30)["range"]["start"] == {
        "line": 1,
        "character": 6,
    }
    definition = editor.request_at("definition", uri, 2, 39)
    assert definition["uri"].endswith("common.task")
    assert definition["range"]["start"]["line"] == 1
    assert editor.request_at("definition", uri, 5, 12)["uri"].endswith("common.task")
    assert editor.request_at("hover", uri, 0, 3) is None


def test_keywords_have_completions_and_hover_texts(editor: Editor, tmp_path: Path) -> None:
    text = """<put> ::= <grasp> <wipe> pauses when touching(arm, guard)
<grasp> ::= already touching(arm, part)
<wipe> ::= touching(arm, part) every 2 s to 4 s
"""
    uri = editor.write(tmp_path / "w.task", text)
    assert editor.diagnostics[uri] == []
    labels = {i["label"] for i in editor.request_at("completion", uri, 1, 39)}
    assert labels >= {"pauses when", "fails when", "every", "already", "for each", "any 2 of"}
    assert "no clock runs" in editor.request_at("hover", uri, 0, 26)["contents"]["value"]
    assert "again and again" in editor.request_at("hover", uri, 2, 32)["contents"]["value"]
    assert "before its turn" in editor.request_at("hover", uri, 1, 13)["contents"]["value"]


def test_files_are_formatted_and_names_renamed_everywhere(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "e.task", TEXT.replace("(arm, ", "(arm ,"))
    options = {"tabSize": 4, "insertSpaces": True}
    formatting = {"textDocument": {"uri": uri}, "options": options}
    (edit,) = editor.request("textDocument/formatting", formatting)
    assert edit["newText"] == TEXT
    renamed = editor.request_at("rename", uri, 2, 18, newName="near")["changes"][uri]
    assert [(e["range"]["start"]["line"], e["newText"]) for e in renamed] == [
        (2, "near"),
        (3, "near"),
    ]
    renamed = editor.request_at("rename", uri, 3, 33, newName="spacecraft")["changes"][uri]
    assert [e["range"]["start"]["line"] for e in renamed] == [1, 3, 4]
    assert "belongs to the language" in editor.rename_refusal(uri, 3, 20, "x")  # an action
    editor.change(uri, "<t> ::= (")
    assert editor.request("textDocument/formatting", formatting) == []


def request_document(editor: Editor, kind: str, uri: str, **more: Any) -> Any:
    return editor.request(f"textDocument/{kind}", {"textDocument": {"uri": uri}, **more})


WHOLE = {"start": {"line": 0, "character": 0}, "end": {"line": 99, "character": 0}}


def test_hints_are_offered_as_code_actions(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "fix.task", TEXT.replace("coupled(", "cupled("))
    (action,) = request_document(
        editor, "codeAction", uri, range=WHOLE, context={"diagnostics": []}
    )
    (edit,) = action["edit"]["changes"][uri]
    assert edit["newText"] == "coupled"
    assert edit["range"]["start"] == {"line": 4, "character": 15}
    assert edit["range"]["end"] == {"line": 4, "character": 21}


def test_symbols_references_and_folding_ranges_are_found(editor: Editor, tmp_path: Path) -> None:
    text = "# one\n# two\n" + TEXT.replace("> <c", ">\n  <c")
    uri = editor.write(tmp_path / "outline.task", text)
    names = [s["name"] for s in request_document(editor, "documentSymbol", uri)]
    assert names == ["dock", "approach", "captured", "satellite"]
    references = editor.request_at("references", uri, 6, 2, context={"includeDeclaration": True})
    assert [u["range"]["start"]["line"] for u in references] == [4, 6]
    folded = {(f["startLine"], f["endLine"]) for f in request_document(editor, "foldingRange", uri)}
    assert folded == {(0, 2), (4, 5)}


def test_signature_help_inlay_hints_and_semantic_tokens_are_given(
    editor: Editor, tmp_path: Path
) -> None:
    uri = editor.write(tmp_path / "hints.task", TEXT)
    signature_help = editor.request_at("signatureHelp", uri, 3, 31)
    assert signature_help["signatures"][0]["label"] == "converging(object, object)"
    assert signature_help["activeParameter"] == 1
    hints = request_document(editor, "inlayHint", uri, range=WHOLE)
    assert [h["label"] for h in hints] == ["until the next begins", "held 1 s"]
    data = request_document(editor, "semanticTokens/full", uri)["data"]
    assert len(data) % 5 == 0
    assert {data[k] for k in range(3, len(data), 5)} == {0, 1, 2}


def test_a_rename_that_changes_the_meaning_is_refused(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "names.task", TEXT)
    assert editor.request_at("prepareRename", uri, 3, 16) is None  # an action
    assert editor.request_at("prepareRename", uri, 3, 2) is not None
    assert "called `captured` already" in editor.rename_refusal(uri, 3, 2, "captured")
    assert "`coupled` is an action" in editor.rename_refusal(uri, 3, 2, "coupled")
    assert "is no name" in editor.rename_refusal(uri, 3, 2, "2 arms")
    assert editor.request_at("rename", uri, 3, 2, newName="reach") is not None


def test_an_undeclared_actor_is_defined_at_its_first_use(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "actors.task", TEXT)
    assert editor.request_at("definition", uri, 4, 24)["range"]["start"]["line"] == 3
    assert editor.request_at("definition", uri, 4, 29)["range"]["start"]["line"] == 1


def test_rule_files_are_served_too(editor: Editor, tmp_path: Path) -> None:
    text = 'rule near(a, b): info\n    when touchng(a, b)\n    say "{a} {b}"\n'
    uri = editor.write(tmp_path / "own.rules", text)
    (diagnostic,) = editor.diagnostics[uri]
    assert "no relation or fact 'touchng'" in diagnostic["message"]
    (action,) = request_document(
        editor, "codeAction", uri, range=WHOLE, context={"diagnostics": []}
    )
    (edit,) = action["edit"]["changes"][uri]
    assert edit["newText"] == "touching"
    assert [s["name"] for s in request_document(editor, "documentSymbol", uri)] == ["near"]
    editor.change(uri, text.replace("touchng", "touching"))
    assert editor.diagnostics[uri] == []
    assert "touching(object, object)" in editor.request_at("hover", uri, 1, 12)["contents"]["value"]
    labels = {i["label"] for i in editor.request_at("completion", uri, 1, 10)}
    assert {"touching", "gap", "within", "let", "rising", "rate"} <= labels
    noted = text.replace("touchng(a, b)", "let x be gap(a, b) at seen(a): gap(a, b) > x")
    editor.change(uri, noted)
    assert editor.diagnostics[uri] == []
    assert "last known to be true" in editor.request_at("hover", uri, 1, 10)["contents"]["value"]


RULES = """rule taken(a, b): info
    when exists c: touching(b, c) and let x be speed(a) at touching(a, b): speed(b) > x  # x
    say "{a} and {b}"
rule other(a): info
    when seen(a)
    say "{a}"
"""


def test_names_of_a_rule_are_renamed_within_the_rule(editor: Editor, tmp_path: Path) -> None:
    uri = editor.write(tmp_path / "my.rules", RULES)
    value = editor.request_at("rename", uri, 1, 42, newName="then")["changes"][uri]
    assert [e["range"]["start"]["character"] for e in value] == [42, 86]
    variable = editor.request_at("rename", uri, 0, 11, newName="arm")["changes"][uri]
    assert [e["range"]["start"]["line"] for e in variable] == [0, 1, 1, 2]
    assert editor.rename_refusal(uri, 1, 42, "a")
    assert editor.rename_refusal(uri, 1, 42, "since")
    assert editor.rename_refusal(uri, 1, 21, "near")  # a word of the language
