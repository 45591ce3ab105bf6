"""The language server of both languages: `tasks/tools/editing.py` over LSP."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, cast

from lsprotocol import types as lsp
from pygls.exceptions import JsonRpcException
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path
from pygls.workspace import ServerTextPosition, ServerTextRange, TextDocument

from visup.agent.model.errors import SourceError, SourceLocation, VisupError
from visup.commands.task.editor_features import (
    FEATURES,
    alike,
    faults_of,
    holds_rules,
    rename_refused,
)
from visup.commands.task.format import formatted_source
from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.keywords import FUNCTIONS, KEYWORDS
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.files import read_beside
from visup.tasks.diagnostics.explain import explain
from visup.tasks.tools.editing import NameUse, completions, definition, hover, name_at
from visup.tasks.tools.rule_editing import rule_completions
from visup.version import __version__

KINDS = {
    "stage": lsp.CompletionItemKind.Class,
    "action": lsp.CompletionItemKind.Function,
    "actor": lsp.CompletionItemKind.Variable,
    "keyword": lsp.CompletionItemKind.Keyword,
    "unit": lsp.CompletionItemKind.Unit,
    "file": lsp.CompletionItemKind.File,
}


LARGEST_MESSAGE_BYTES = 2**26


def serve(sent: BinaryIO, answers: BinaryIO) -> None:
    """Serve one editor until it exits or disconnects.

    Raises:
        SourceError: It announces a message over the size limit.
    """
    make_server().start_io(cast("BinaryIO", EditorInput(sent)), answers)


class EditorInput:
    """The input from an editor; limits the memory for a message.

    Args:
        sent: The stream.
    """

    def __init__(self, sent: BinaryIO) -> None:
        self.readline = partial(sent.readline, LARGEST_MESSAGE_BYTES)
        self._read = sent.read

    def read(self, count: int) -> bytes:
        """Read bytes of a message.

        Raises:
            SourceError: They are over the size limit.
        """
        if count > LARGEST_MESSAGE_BYTES:
            raise SourceError(
                f"the editor sends a message of {count} bytes",
                expected=f"at most {LARGEST_MESSAGE_BYTES >> 20} MB",
            )
        return self._read(count)


def make_server() -> LanguageServer:
    """A language server with `_FEATURES` and `editor_features.FEATURES`."""
    server = LanguageServer("visup-task", __version__)
    for feature, handler, options in (*_FEATURES, *FEATURES):
        server.feature(feature, options)(handler)
    return server


def _opened(ls: LanguageServer, params: lsp.DidOpenTextDocumentParams) -> None:
    _publish(ls, params.text_document.uri)


def _changed(ls: LanguageServer, params: lsp.DidChangeTextDocumentParams) -> None:
    _publish(ls, params.text_document.uri)


def _closed(ls: LanguageServer, params: lsp.DidCloseTextDocumentParams) -> None:
    none = lsp.PublishDiagnosticsParams(params.text_document.uri, [])
    ls.text_document_publish_diagnostics(none)


def _complete(ls: LanguageServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    document = ls.workspace.get_text_document(params.text_document.uri)
    if holds_rules(document):
        found = list(rule_completions())
    else:
        line, column = _from(document, params.position)
        found = completions(document.source, _file(document), line, column)
    return [lsp.CompletionItem(p.text, kind=KINDS[p.kind], detail=p.about) for p in found]


def _rule_meaning(document: TextDocument, word: NameUse) -> str | None:
    if entry := KEYWORDS.get(word.name) or FUNCTIONS.get(word.name):
        return f"`{entry[0]}`: {entry[1]}"
    known = PREDICATES.get(word.name) or QUANTITIES.get(word.name)
    return f"`{word.name}({', '.join(known.argument_kinds)})`: {known.meaning}" if known else None


def _show_meaning(ls: LanguageServer, params: lsp.HoverParams) -> lsp.Hover | None:
    document, word = _word(ls, params)
    text = None
    if word is not None and holds_rules(document):
        text = _rule_meaning(document, word)
    elif word is not None:
        text = hover(document.source, _file(document), word)
    if word is None or text is None:
        return None
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    return lsp.Hover(content, _range(document, word.span))


def _define(ls: LanguageServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    document, word = _word(ls, params)
    return _location(ls, document, word) if word else None


def _format(ls: LanguageServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
    document = ls.workspace.get_text_document(params.text_document.uri)
    if holds_rules(document):
        return []  # rules have no standard layout
    try:
        new = formatted_source(document.source, _file(document))
    except VisupError:
        return []  # the errors are already shown
    if new == document.source:
        return []
    end = lsp.Position(len(document.lines), 0)
    return [lsp.TextEdit(lsp.Range(lsp.Position(0, 0), end), new)]


def _rename(ls: LanguageServer, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
    document, word = _word(ls, params)
    new = params.new_name.strip("<> ")
    if word is None:
        raise _refused("here is no name that could be changed")
    refused = rename_refused(document, word, new)
    if refused is not None:
        raise _refused(refused)
    places = alike(document, word)
    if not places:
        raise _refused(f"`{word.name}` belongs to the language, so it cannot be renamed")
    edits = [lsp.TextEdit(_range(document, w.span), new) for w in places]
    return lsp.WorkspaceEdit({document.uri: edits})


def _refused(why: str) -> JsonRpcException:
    """The answer of a request that is refused; editors show its reason."""
    return JsonRpcException(why, lsp.LSPErrorCodes.RequestFailed.value)


_FEATURES: tuple[tuple[str, Callable[..., Any], Any], ...] = (
    (lsp.TEXT_DOCUMENT_DID_OPEN, _opened, None),
    (lsp.TEXT_DOCUMENT_DID_CHANGE, _changed, None),
    (lsp.TEXT_DOCUMENT_DID_CLOSE, _closed, None),
    (
        lsp.TEXT_DOCUMENT_COMPLETION,
        _complete,
        lsp.CompletionOptions(trigger_characters=["<", "(", '"']),
    ),
    (lsp.TEXT_DOCUMENT_HOVER, _show_meaning, None),
    (lsp.TEXT_DOCUMENT_DEFINITION, _define, None),
    (lsp.TEXT_DOCUMENT_FORMATTING, _format, None),
    (lsp.TEXT_DOCUMENT_RENAME, _rename, None),
)
"""LSP method, handler and options of each feature."""


def _publish(server: LanguageServer, uri: str) -> None:
    document = server.workspace.get_text_document(uri)
    if holds_rules(document):
        faults = faults_of(document)
    else:
        files = _EditorFiles(server, Path(_file(document)).parent)
        _, faults = diagnose(document.source, _file(document), read=files.read)
    shown = [_diagnostic(document, f) for f in faults]
    server.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, shown))


class _EditorFiles:
    """Reads included files from the editor if open there, else from a folder and below on disk."""

    def __init__(self, server: LanguageServer, root: Path) -> None:
        self._root = root
        self._open = {to_fs_path(u): d for u, d in server.workspace.text_documents.items()}

    def read(self, path: str, including: str) -> tuple[str, str]:
        beside = str((Path(including).parent / path).resolve())
        if beside in self._open:
            return beside, self._open[beside].source
        return read_beside(path, including, self._root)


def _diagnostic(document: TextDocument, fault: Diagnostic) -> lsp.Diagnostic:
    text = [fault.message]
    text += [f"expected: {fault.expected}"] if fault.expected else []
    text += [f"hint: {fault.hint}"] if fault.hint else []
    place = fault.place
    if place.file != _file(document):
        text.insert(0, f"in {place}")
        place = SourceLocation(_file(document), 1, 1)
    span = Span(place.line, place.column, place.line, place.column + place.length)
    return lsp.Diagnostic(
        _range(document, span),
        "\n".join(text),
        severity=lsp.DiagnosticSeverity.Error,
        code=fault.code or None,
        source=f"visup: {explain(fault.code).title}" if fault.code else "visup",
    )


def _word(
    server: LanguageServer, params: lsp.HoverParams | lsp.DefinitionParams | lsp.RenameParams
) -> tuple[TextDocument, NameUse | None]:
    document = server.workspace.get_text_document(params.text_document.uri)
    return document, name_at(document.source, *_from(document, params.position))


def _location(server: LanguageServer, document: TextDocument, word: NameUse) -> lsp.Location | None:
    if word.kind == "include":
        try:
            path, _ = _EditorFiles(server, Path(_file(document)).parent).read(
                word.name, _file(document)
            )
        except VisupError:
            return None
        uri = from_fs_path(str(Path(path).resolve())) if Path(path).exists() else None
        start = lsp.Position(0, 0)
        return lsp.Location(uri, lsp.Range(start, start)) if uri else None
    span = definition(document.source, _file(document), word)
    if span is None:
        return None
    if not span.file:
        return lsp.Location(document.uri, _range(document, span))
    uri = from_fs_path(str(Path(span.file).resolve()))
    other = server.workspace.get_text_document(uri) if uri and Path(span.file).exists() else None
    return lsp.Location(other.uri, _range(other, span)) if other else None


def _file(document: TextDocument) -> str:
    return to_fs_path(document.uri) or document.uri


def _from(document: TextDocument, position: lsp.Position) -> tuple[int, int]:
    """Line and column counted from 1, in characters."""
    here = document.position_from_client_units(position)
    return here.line + 1, here.character + 1


def _range(document: TextDocument, span: Span) -> lsp.Range:
    start = ServerTextPosition(span.line - 1, span.column - 1)
    end = ServerTextPosition(max(span.line, span.end_line) - 1, span.end_column - 1)
    return document.range_to_client_units(ServerTextRange(start, end))
