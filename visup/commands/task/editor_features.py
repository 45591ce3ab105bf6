"""Outline, references, quick fixes, semantic tokens and inlay hints of task and rule files, for editors.

The same handlers serve both languages; a file whose name ends in `.rules` holds rules.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

from lsprotocol import types as lsp
from pygls.lsp.server import LanguageServer
from pygls.uris import to_fs_path
from pygls.workspace import ServerTextPosition, ServerTextRange, TextDocument

from visup.commands.task.rule_names import rule_references, rule_rename_refusal
from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.fixes import TextFix, fix_of
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.tasks.actions.actions import known_actions
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.grammar.templates import called
from visup.tasks.tools.editing import NameUse, name_at, names, references
from visup.tasks.tools.rule_editing import rule_faults

TOKEN_KINDS = ("class", "function", "variable", "keyword")
_RULE = re.compile(r"^[ \t]*rule\s+(\w+)", re.MULTILINE)
_HEAD = re.compile(r"^[ \t]*(?:task\s+)?<[^<>]*>\s*::=", re.MULTILINE)
_CALL = re.compile(r"([^\W\d]\w*)\s*\(([^()]*)\)")
_WORDS = re.compile(r"[^\W\d]\w*")


def is_rule_file(document: TextDocument) -> bool:
    """Whether a document is a rule file, not a task file."""
    return document.uri.endswith(".rules")


def diagnostics_of(document: TextDocument) -> list[Diagnostic]:
    """The mistakes of a document in either language."""
    if not is_rule_file(document):
        return diagnose(document.source, file_of(document))[1]
    return rule_faults(document.source, file_of(document))


def code_actions(ls: LanguageServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    """Each hint in a range that is a text edit, as a code action."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    actions = []
    for diagnostic in diagnostics_of(document):
        fix = fix_of(document.source, diagnostic.place, diagnostic.hint)
        first, last = params.range.start.line, params.range.end.line
        if fix is None or not first <= diagnostic.place.line - 1 <= last:
            continue
        edit = lsp.TextEdit(_range_of(document, fix), fix.new)
        actions.append(
            lsp.CodeAction(
                (diagnostic.hint or "").split("; ")[-1],
                kind=lsp.CodeActionKind.QuickFix,
                is_preferred=True,
                edit=lsp.WorkspaceEdit({document.uri: [edit]}),
            )
        )
    return actions


def document_symbols(
    ls: LanguageServer, params: lsp.DocumentSymbolParams
) -> list[lsp.DocumentSymbol]:
    """Stages and declarations, or rules."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    if is_rule_file(document):
        return [
            _symbol(
                document, m[1], lsp.SymbolKind.Event, _span(document.source, m.start(1), m.end(1))
            )
            for m in _RULE.finditer(document.source)
        ]
    task, _ = diagnose(document.source, file_of(document))
    stages = [stage for stage in task.stages if not stage.span.file]
    by_name = {
        called(stage.name)[0]: _symbol(document, stage.name, lsp.SymbolKind.Class, stage.span)
        for stage in stages
    }
    declared = [d for d in task.declared if d.span.line and not d.span.file]
    return [
        *by_name.values(),
        *(_symbol(document, d.name, lsp.SymbolKind.Variable, d.span) for d in declared),
    ]


def find_references(ls: LanguageServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    """All references in a file to the same stage, actor, zone, parameter, or variable of a rule."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    word = _word(document, params.position)
    found = [] if word is None else same_references(document, word)
    return [lsp.Location(document.uri, span_range(document, w.span)) for w in found]


def prepare_rename(ls: LanguageServer, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    """The range of a name that can be renamed; None refuses."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    word = _word(document, params.position)
    if word is None or not same_references(document, word):
        return None
    return span_range(document, word.span)


def same_references(document: TextDocument, word: NameUse) -> list[NameUse]:
    """All references in a document to the same entity as one of its words."""
    find_uses = rule_references if is_rule_file(document) else references
    return find_uses(document.source, word)


def rename_refusal(document: TextDocument, word: NameUse, new: str) -> str | None:
    """Why a name cannot be renamed, or None if it can."""
    text = document.source
    if is_rule_file(document):
        return rule_rename_refusal(text, word, new)
    if not new.isidentifier():
        return f"`{new}` is no name: letters, digits and `_`, beginning with a letter"
    if any(w.name == new and w.kind == word.kind for w in names(text)):
        return f"there is something called `{new}` already"
    if word.kind == "stage" and new in known_actions():
        return f"`{new}` is an action"
    return None


def folding_ranges(ls: LanguageServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
    """Statements and comment blocks of several lines."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    text = document.source
    pattern = _RULE if is_rule_file(document) else _HEAD
    starts = [text.count("\n", 0, m.start()) for m in pattern.finditer(text)]
    lines = text.split("\n")
    ranges = [
        _folding_range(lines, begin, end)
        for begin, end in zip(starts, [*starts[1:], len(lines)], strict=True)
    ]
    return [r for r in [*ranges, *_comment_ranges(lines)] if r.end_line > r.start_line]


def _folding_range(lines: list[str], begin: int, end: int) -> lsp.FoldingRange:
    while end > begin + 1 and (
        not lines[end - 1].strip() or lines[end - 1].lstrip().startswith("#")
    ):
        end -= 1
    return lsp.FoldingRange(begin, end - 1)


def _comment_ranges(lines: list[str]) -> Iterator[lsp.FoldingRange]:
    begin = None
    for number, line in enumerate([*lines, ""]):
        comment = line.lstrip().startswith("#")
        if comment and begin is None:
            begin = number
        if not comment and begin is not None:
            yield lsp.FoldingRange(begin, number - 1, kind=lsp.FoldingRangeKind.Comment)
            begin = None


def signature_help(ls: LanguageServer, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    """The arguments of an action, predicate or quantity, while they are typed."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    cursor = document.position_from_client_units(params.position)
    before = document.lines[cursor.line][: cursor.character] if document.lines else ""
    call = re.search(r"([^\W\d]\w*)\s*\(([^()]*)$", before)
    parameters = _parameters(document, call[1]) if call else None
    if call is None or parameters is None:
        return None
    kinds, about = parameters
    label = f"{call[1]}({', '.join(kinds)})"
    information = lsp.SignatureInformation(
        label, about, [lsp.ParameterInformation(k) for k in kinds]
    )
    return lsp.SignatureHelp([information], 0, call[2].count(","))


def _parameters(document: TextDocument, name: str) -> tuple[tuple[str, ...], str] | None:
    if is_rule_file(document):
        word = PREDICATES.get(name) or QUANTITIES.get(name)
        return (word.argument_kinds, word.meaning) if word else None
    action = known_actions().get(name)
    return (action.kinds, action.about) if action else None


def semantic_tokens(ls: LanguageServer, params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
    """Semantic tokens: stages, actions, actors."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    data: list[int] = []
    line = column = 0
    for row, start, length, kind in _tokens(document):
        if row != line:
            column = 0
        data += [row - line, start - column, length, kind, 0]
        line, column = row, start
    return lsp.SemanticTokens(data)


def _tokens(document: TextDocument) -> Iterator[tuple[int, int, int, int]]:
    """Line, column, length and kind of each token, in document order."""
    if not is_rule_file(document):
        kinds = {"stage": 0, "action": 1, "name": 2}
        for word in names(document.source):
            if word.kind in kinds:
                span = word.span
                yield span.line - 1, span.column - 1, len(word.name), kinds[word.kind]
        return
    for row, line in enumerate(document.source.split("\n")):
        code = re.sub(r'"[^"]*"|#.*', lambda m: " " * len(m[0]), line)
        for m in _WORDS.finditer(code):
            is_called = code[m.end() : m.end() + 1] == "("
            kind = 1 if is_called else 2 if len(m[0]) <= 2 else 3
            yield row, m.start(), len(m[0]), kind


def inlay_hints(ls: LanguageServer, params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
    """After each action of a task, when it ends."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    hints: list[lsp.InlayHint] = []
    if is_rule_file(document):
        return hints
    lines = document.source.split("\n")
    for row in range(params.range.start.line, min(params.range.end.line + 1, len(lines))):
        code = re.sub(r'"[^"]*"|#.*', lambda m: " " * len(m[0]), lines[row])
        for m in _CALL.finditer(code):
            action = known_actions().get(m[1])
            if action is None or action.measures or re.match(r"\s*(?:for|ends)\b", code[m.end() :]):
                continue
            repetition = re.match(r"\s*every\b(?P<more>[^|&<()]*)", code[m.end() :])
            if repetition is not None and re.search(r"\b(?:for|ends)\b", repetition["more"]):
                continue
            lasts = action.lasts or repetition is not None
            label = "until the next begins" if lasts else f"held {action.hold_s:g} s"
            position = document.range_to_client_units(
                ServerTextRange(ServerTextPosition(row, m.end()), ServerTextPosition(row, m.end()))
            )
            hints.append(lsp.InlayHint(position.start, label, padding_left=True))
    return hints


def file_of(document: TextDocument) -> str:
    """The path of a document, or its name."""
    return to_fs_path(document.uri) or document.uri


def span_range(document: TextDocument, span: Span) -> lsp.Range:
    """A span as a range in the editor's units."""
    start = ServerTextPosition(span.line - 1, span.column - 1)
    end = ServerTextPosition(max(span.line, span.end_line) - 1, span.end_column - 1)
    return document.range_to_client_units(ServerTextRange(start, end))


def _range_of(document: TextDocument, fix: TextFix) -> lsp.Range:
    lines = document.source.split("\n")
    line, column, remaining = fix.line - 1, fix.column - 1, fix.length
    while line < len(lines) - 1 and column + remaining > len(lines[line]):
        remaining -= len(lines[line]) - column + 1
        line, column = line + 1, 0
    span = Span(fix.line, fix.column, line + 1, column + remaining + 1)
    return span_range(document, span)


def _symbol(
    document: TextDocument, name: str, kind: lsp.SymbolKind, span: Span
) -> lsp.DocumentSymbol:
    symbol_range = span_range(document, span)
    return lsp.DocumentSymbol(name, kind, symbol_range, symbol_range)


def _span(text: str, begin: int, end: int) -> Span:
    line, column = text.count("\n", 0, begin) + 1, begin - text.rfind("\n", 0, begin)
    return Span(line, column, line, column + end - begin)


def _word(document: TextDocument, position: lsp.Position) -> NameUse | None:
    cursor = document.position_from_client_units(position)
    return name_at(document.source, cursor.line + 1, cursor.character + 1)


FEATURES: tuple[tuple[str, Callable[..., Any], Any], ...] = (
    (
        lsp.TEXT_DOCUMENT_CODE_ACTION,
        code_actions,
        lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix]),
    ),
    (lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, document_symbols, None),
    (lsp.TEXT_DOCUMENT_REFERENCES, find_references, None),
    (lsp.TEXT_DOCUMENT_PREPARE_RENAME, prepare_rename, None),
    (lsp.TEXT_DOCUMENT_FOLDING_RANGE, folding_ranges, None),
    (lsp.TEXT_DOCUMENT_SIGNATURE_HELP, signature_help, lsp.SignatureHelpOptions(["(", ","])),
    (
        lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL,
        semantic_tokens,
        lsp.SemanticTokensLegend(list(TOKEN_KINDS), []),
    ),
    (lsp.TEXT_DOCUMENT_INLAY_HINT, inlay_hints, None),
)
"""Features besides diagnostics, completion, hover, definitions, formatting and renaming."""
