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
from pygls.workspace import TextDocument

from visup.agent.model.errors import SourceError, SourceLocation, VisupError
from visup.commands.task.editor_features import (
    FEATURES,
    diagnostics_of,
    file_of,
    is_rule_file,
    rename_refusal,
    same_references,
    span_range,
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

COMPLETION_KINDS = {
    "stage": lsp.CompletionItemKind.Class,
    "action": lsp.CompletionItemKind.Function,
    "actor": lsp.CompletionItemKind.Variable,
    "keyword": lsp.CompletionItemKind.Keyword,
    "unit": lsp.CompletionItemKind.Unit,
    "file": lsp.CompletionItemKind.File,
}


MAX_MESSAGE_BYTES = 2**26


def serve(editor_input: BinaryIO, editor_output: BinaryIO) -> None:
    """Serve one editor until it exits or disconnects.

    Raises:
        SourceError: It announces a message over the size limit.
    """
    make_server().start_io(cast("BinaryIO", EditorInput(editor_input)), editor_output)


class EditorInput:
    """The input from an editor; limits the memory for a message.

    Args:
        stream: What the editor sends.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self.readline = partial(stream.readline, MAX_MESSAGE_BYTES)
        self._read = stream.read

    def read(self, count: int) -> bytes:
        """Read bytes of a message.

        Raises:
            SourceError: They are over the size limit.
        """
        if count > MAX_MESSAGE_BYTES:
            raise SourceError(
                f"the editor sends a message of {count} bytes",
                expected=f"at most {MAX_MESSAGE_BYTES >> 20} MB",
            )
        return self._read(count)


def make_server() -> LanguageServer:
    """A language server with `_FEATURES` and `editor_features.FEATURES`."""
    server = LanguageServer("visup-task", __version__)
    for feature, handler, options in (*_FEATURES, *FEATURES):
        server.feature(feature, options)(handler)
    return server


def _did_open(ls: LanguageServer, params: lsp.DidOpenTextDocumentParams) -> None:
    _publish(ls, params.text_document.uri)


def _did_change(ls: LanguageServer, params: lsp.DidChangeTextDocumentParams) -> None:
    _publish(ls, params.text_document.uri)


def _did_close(ls: LanguageServer, params: lsp.DidCloseTextDocumentParams) -> None:
    none = lsp.PublishDiagnosticsParams(params.text_document.uri, [])
    ls.text_document_publish_diagnostics(none)


def _complete(ls: LanguageServer, params: lsp.CompletionParams) -> list[lsp.CompletionItem]:
    document = ls.workspace.get_text_document(params.text_document.uri)
    if is_rule_file(document):
        proposals = list(rule_completions())
    else:
        line, column = _line_and_column(document, params.position)
        proposals = completions(document.source, file_of(document), line, column)
    return [
        lsp.CompletionItem(
            proposal.text, kind=COMPLETION_KINDS[proposal.kind], detail=proposal.about
        )
        for proposal in proposals
    ]


def _rule_meaning(document: TextDocument, word: NameUse) -> str | None:
    if keyword := KEYWORDS.get(word.name) or FUNCTIONS.get(word.name):
        return f"`{keyword[0]}`: {keyword[1]}"
    entry = PREDICATES.get(word.name) or QUANTITIES.get(word.name)
    return f"`{word.name}({', '.join(entry.argument_kinds)})`: {entry.meaning}" if entry else None


def _hover(ls: LanguageServer, params: lsp.HoverParams) -> lsp.Hover | None:
    document, word = _word(ls, params)
    text = None
    if word is not None and is_rule_file(document):
        text = _rule_meaning(document, word)
    elif word is not None:
        text = hover(document.source, file_of(document), word)
    if word is None or text is None:
        return None
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, text)
    return lsp.Hover(content, span_range(document, word.span))


def _goto_definition(ls: LanguageServer, params: lsp.DefinitionParams) -> lsp.Location | None:
    document, word = _word(ls, params)
    return _location(ls, document, word) if word else None


def _format(ls: LanguageServer, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
    document = ls.workspace.get_text_document(params.text_document.uri)
    if is_rule_file(document):
        return []  # rules have no standard layout
    try:
        new = formatted_source(document.source, file_of(document))
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
        raise _request_failed("here is no name that could be changed")
    refusal = rename_refusal(document, word, new)
    if refusal is not None:
        raise _request_failed(refusal)
    uses = same_references(document, word)
    if not uses:
        raise _request_failed(f"`{word.name}` belongs to the language, so it cannot be renamed")
    edits = [lsp.TextEdit(span_range(document, w.span), new) for w in uses]
    return lsp.WorkspaceEdit({document.uri: edits})


def _request_failed(reason: str) -> JsonRpcException:
    """The answer of a request that is refused; editors show its reason."""
    return JsonRpcException(reason, lsp.LSPErrorCodes.RequestFailed.value)


_FEATURES: tuple[tuple[str, Callable[..., Any], Any], ...] = (
    (lsp.TEXT_DOCUMENT_DID_OPEN, _did_open, None),
    (lsp.TEXT_DOCUMENT_DID_CHANGE, _did_change, None),
    (lsp.TEXT_DOCUMENT_DID_CLOSE, _did_close, None),
    (
        lsp.TEXT_DOCUMENT_COMPLETION,
        _complete,
        lsp.CompletionOptions(trigger_characters=["<", "(", '"']),
    ),
    (lsp.TEXT_DOCUMENT_HOVER, _hover, None),
    (lsp.TEXT_DOCUMENT_DEFINITION, _goto_definition, None),
    (lsp.TEXT_DOCUMENT_FORMATTING, _format, None),
    (lsp.TEXT_DOCUMENT_RENAME, _rename, None),
)
"""LSP method, handler and options of each feature."""


def _publish(server: LanguageServer, uri: str) -> None:
    document = server.workspace.get_text_document(uri)
    if is_rule_file(document):
        diagnostics = diagnostics_of(document)
    else:
        files = _EditorFiles(server, Path(file_of(document)).parent)
        _, diagnostics = diagnose(document.source, file_of(document), read=files.read)
    published = [_diagnostic(document, d) for d in diagnostics]
    server.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, published))


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


def _diagnostic(document: TextDocument, diagnostic: Diagnostic) -> lsp.Diagnostic:
    lines = [diagnostic.message]
    lines += [f"expected: {diagnostic.expected}"] if diagnostic.expected else []
    lines += [f"hint: {diagnostic.hint}"] if diagnostic.hint else []
    place = diagnostic.place
    if place.file != file_of(document):
        lines.insert(0, f"in {place}")
        place = SourceLocation(file_of(document), 1, 1)
    span = Span(place.line, place.column, place.line, place.column + place.length)
    return lsp.Diagnostic(
        span_range(document, span),
        "\n".join(lines),
        severity=lsp.DiagnosticSeverity.Error,
        code=diagnostic.code or None,
        source=f"visup: {explain(diagnostic.code).title}" if diagnostic.code else "visup",
    )


def _word(
    server: LanguageServer, params: lsp.HoverParams | lsp.DefinitionParams | lsp.RenameParams
) -> tuple[TextDocument, NameUse | None]:
    document = server.workspace.get_text_document(params.text_document.uri)
    return document, name_at(document.source, *_line_and_column(document, params.position))


def _location(server: LanguageServer, document: TextDocument, word: NameUse) -> lsp.Location | None:
    if word.kind == "include":
        try:
            path, _ = _EditorFiles(server, Path(file_of(document)).parent).read(
                word.name, file_of(document)
            )
        except VisupError:
            return None
        uri = from_fs_path(str(Path(path).resolve())) if Path(path).exists() else None
        start = lsp.Position(0, 0)
        return lsp.Location(uri, lsp.Range(start, start)) if uri else None
    span = definition(document.source, file_of(document), word)
    if span is None:
        return None
    if not span.file:
        return lsp.Location(document.uri, span_range(document, span))
    uri = from_fs_path(str(Path(span.file).resolve()))
    other = server.workspace.get_text_document(uri) if uri and Path(span.file).exists() else None
    return lsp.Location(other.uri, span_range(other, span)) if other else None


def _line_and_column(document: TextDocument, position: lsp.Position) -> tuple[int, int]:
    """Line and column counted from 1, in characters."""
    cursor = document.position_from_client_units(position)
    return cursor.line + 1, cursor.character + 1
