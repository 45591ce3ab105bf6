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

from visup.commands.task.rule_names import rule_references, rule_rename_refused
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


def holds_rules(document: TextDocument) -> bool:
    """Whether a document is a rule file, not a task file."""
    return document.uri.endswith(".rules")


def faults_of(document: TextDocument) -> list[Diagnostic]:
    """The mistakes of a document in either language."""
    if not holds_rules(document):
        return diagnose(document.source, file_of(document))[1]
    return rule_faults(document.source, file_of(document))


def code_actions(ls: LanguageServer, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
    """Each hint in a range that is a text edit, as a code action."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    found = []
    for fault in faults_of(document):
        fix = fix_of(document.source, fault.place, fault.hint)
        first, last = params.range.start.line, params.range.end.line
        if fix is None or not first <= fault.place.line - 1 <= last:
            continue
        edit = lsp.TextEdit(_range_of(document, fix), fix.new)
        found.append(
            lsp.CodeAction(
                (fault.hint or "").split("; ")[-1],
                kind=lsp.CodeActionKind.QuickFix,
                is_preferred=True,
                edit=lsp.WorkspaceEdit({document.uri: [edit]}),
            )
        )
    return found


def symbols(ls: LanguageServer, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
    """Stages and declarations, or rules."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    if holds_rules(document):
        return [
            _symbol(
                document, m[1], lsp.SymbolKind.Event, _span(document.source, m.start(1), m.end(1))
            )
            for m in _RULE.finditer(document.source)
        ]
    task, _ = diagnose(document.source, file_of(document))
    own = [s for s in task.stages if not s.span.file]
    found = {
        called(s.name)[0]: _symbol(document, s.name, lsp.SymbolKind.Class, s.span) for s in own
    }
    declared = [d for d in task.declared if d.span.line and not d.span.file]
    return [
        *found.values(),
        *(_symbol(document, d.name, lsp.SymbolKind.Variable, d.span) for d in declared),
    ]


def uses(ls: LanguageServer, params: lsp.ReferenceParams) -> list[lsp.Location]:
    """All references in a file to the same stage, actor, zone, parameter, or variable of a rule."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    word = _word(document, params.position)
    found = [] if word is None else alike(document, word)
    return [lsp.Location(document.uri, span_range(document, w.span)) for w in found]


def prepare_rename(ls: LanguageServer, params: lsp.PrepareRenameParams) -> lsp.Range | None:
    """The range of a name that can be renamed; None refuses."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    word = _word(document, params.position)
    if word is None or not alike(document, word):
        return None
    return span_range(document, word.span)


def alike(document: TextDocument, word: NameUse) -> list[NameUse]:
    """All references in a document to the same entity as one of its words."""
    find = rule_references if holds_rules(document) else references
    return find(document.source, word)


def rename_refused(document: TextDocument, word: NameUse, new: str) -> str | None:
    """Why a name cannot be renamed, or None if it can."""
    text = document.source
    if holds_rules(document):
        return rule_rename_refused(text, word, new)
    if not new.isidentifier():
        return f"`{new}` is no name: letters, digits and `_`, beginning with a letter"
    if any(w.name == new and w.kind == word.kind for w in names(text)):
        return f"there is something called `{new}` already"
    if word.kind == "stage" and new in known_actions():
        return f"`{new}` is an action"
    return None


def folds(ls: LanguageServer, params: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
    """Statements and comment blocks of several lines."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    text = document.source
    pattern = _RULE if holds_rules(document) else _HEAD
    starts = [text.count("\n", 0, m.start()) for m in pattern.finditer(text)]
    lines = text.split("\n")
    found = [_folded(lines, a, b) for a, b in zip(starts, [*starts[1:], len(lines)], strict=True)]
    return [f for f in [*found, *_comments(lines)] if f.end_line > f.start_line]


def _folded(lines: list[str], begin: int, end: int) -> lsp.FoldingRange:
    while end > begin + 1 and (
        not lines[end - 1].strip() or lines[end - 1].lstrip().startswith("#")
    ):
        end -= 1
    return lsp.FoldingRange(begin, end - 1)


def _comments(lines: list[str]) -> Iterator[lsp.FoldingRange]:
    begin = None
    for number, line in enumerate([*lines, ""]):
        comment = line.lstrip().startswith("#")
        if comment and begin is None:
            begin = number
        if not comment and begin is not None:
            yield lsp.FoldingRange(begin, number - 1, kind=lsp.FoldingRangeKind.Comment)
            begin = None


def signature(ls: LanguageServer, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
    """The arguments of an action, predicate or quantity, while they are typed."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    here = document.position_from_client_units(params.position)
    before = document.lines[here.line][: here.character] if document.lines else ""
    found = re.search(r"([^\W\d]\w*)\s*\(([^()]*)$", before)
    takes = _takes(document, found[1]) if found else None
    if found is None or takes is None:
        return None
    kinds, about = takes
    label = f"{found[1]}({', '.join(kinds)})"
    information = lsp.SignatureInformation(
        label, about, [lsp.ParameterInformation(k) for k in kinds]
    )
    return lsp.SignatureHelp([information], 0, found[2].count(","))


def _takes(document: TextDocument, name: str) -> tuple[tuple[str, ...], str] | None:
    if holds_rules(document):
        word = PREDICATES.get(name) or QUANTITIES.get(name)
        return (word.argument_kinds, word.meaning) if word else None
    action = known_actions().get(name)
    return (action.kinds, action.about) if action else None


def tokens(ls: LanguageServer, params: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
    """Semantic tokens: stages, actions, actors."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    data: list[int] = []
    line = column = 0
    for row, at, length, kind in _tokens(document):
        if row != line:
            column = 0
        data += [row - line, at - column, length, kind, 0]
        line, column = row, at
    return lsp.SemanticTokens(data)


def _tokens(document: TextDocument) -> Iterator[tuple[int, int, int, int]]:
    """Line, column, length and kind of each token, in document order."""
    if not holds_rules(document):
        kinds = {"stage": 0, "action": 1, "name": 2}
        for word in names(document.source):
            if word.kind in kinds:
                span = word.span
                yield span.line - 1, span.column - 1, len(word.name), kinds[word.kind]
        return
    for row, line in enumerate(document.source.split("\n")):
        code = re.sub(r'"[^"]*"|#.*', lambda m: " " * len(m[0]), line)
        for m in _WORDS.finditer(code):
            called_here = code[m.end() : m.end() + 1] == "("
            kind = 1 if called_here else 2 if len(m[0]) <= 2 else 3
            yield row, m.start(), len(m[0]), kind


def inlays(ls: LanguageServer, params: lsp.InlayHintParams) -> list[lsp.InlayHint]:
    """After each action of a task, when it ends."""
    document = ls.workspace.get_text_document(params.text_document.uri)
    found: list[lsp.InlayHint] = []
    if holds_rules(document):
        return found
    lines = document.source.split("\n")
    for row in range(params.range.start.line, min(params.range.end.line + 1, len(lines))):
        code = re.sub(r'"[^"]*"|#.*', lambda m: " " * len(m[0]), lines[row])
        for m in _CALL.finditer(code):
            action = known_actions().get(m[1])
            if action is None or action.measures or re.match(r"\s*(?:for|ends)\b", code[m.end() :]):
                continue
            again = re.match(r"\s*every\b(?P<more>[^|&<()]*)", code[m.end() :])
            if again is not None and re.search(r"\b(?:for|ends)\b", again["more"]):
                continue
            lasts = action.lasts or again is not None
            said = "until the next begins" if lasts else f"held {action.hold_s:g} s"
            at = document.range_to_client_units(
                ServerTextRange(ServerTextPosition(row, m.end()), ServerTextPosition(row, m.end()))
            )
            found.append(lsp.InlayHint(at.start, said, padding_left=True))
    return found


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
    line, column, left = fix.line - 1, fix.column - 1, fix.length
    while line < len(lines) - 1 and column + left > len(lines[line]):
        left -= len(lines[line]) - column + 1
        line, column = line + 1, 0
    span = Span(fix.line, fix.column, line + 1, column + left + 1)
    return span_range(document, span)


def _symbol(
    document: TextDocument, name: str, kind: lsp.SymbolKind, span: Span
) -> lsp.DocumentSymbol:
    place = span_range(document, span)
    return lsp.DocumentSymbol(name, kind, place, place)


def _span(text: str, begin: int, end: int) -> Span:
    line, column = text.count("\n", 0, begin) + 1, begin - text.rfind("\n", 0, begin)
    return Span(line, column, line, column + end - begin)


def _word(document: TextDocument, position: lsp.Position) -> NameUse | None:
    here = document.position_from_client_units(position)
    return name_at(document.source, here.line + 1, here.character + 1)


FEATURES: tuple[tuple[str, Callable[..., Any], Any], ...] = (
    (
        lsp.TEXT_DOCUMENT_CODE_ACTION,
        code_actions,
        lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix]),
    ),
    (lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL, symbols, None),
    (lsp.TEXT_DOCUMENT_REFERENCES, uses, None),
    (lsp.TEXT_DOCUMENT_PREPARE_RENAME, prepare_rename, None),
    (lsp.TEXT_DOCUMENT_FOLDING_RANGE, folds, None),
    (lsp.TEXT_DOCUMENT_SIGNATURE_HELP, signature, lsp.SignatureHelpOptions(["(", ","])),
    (
        lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL,
        tokens,
        lsp.SemanticTokensLegend(list(TOKEN_KINDS), []),
    ),
    (lsp.TEXT_DOCUMENT_INLAY_HINT, inlays, None),
)
"""Features besides diagnostics, completion, hover, definitions, formatting and renaming."""
