"""Syntax files for editors without a language server: Vim, Emacs, and highlight.js for web pages.

The words are extracted from the two grammars, so that the files are complete.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from visup.rules.formula.units import Unit
from visup.rules.language.error_recovery import grammar as rules_grammar
from visup.rules.traits.colours import TERMS
from visup.tasks.grammar.parser import grammar as tasks_grammar
from visup.tasks.grammar.units import UNITS

SEVERITIES = ("info", "warning", "critical")
STAGE = r"<\s*[A-Za-z_]\w*\s*(?:\([\w ,]*\)\s*)?>"
NUMBER = r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
_NOTE = "made by `visup task syntax {editor} --language {language}`"


@dataclass(frozen=True)
class Syntax:
    """The syntax of a language for editors.

    Attributes:
        name: 'task' or 'rules'; also the suffix of its files.
        grammar: Its grammar.
        constants: Words that are values.
        units: Its units.
    """

    name: str
    grammar: str
    constants: tuple[str, ...]
    units: tuple[str, ...]

    @cached_property
    def keywords(self) -> tuple[str, ...]:
        """The keywords that are neither values nor units, in alphabetical order."""
        found = set(keywords_of(self.grammar)) - {*self.constants, *self.units}
        return tuple(sorted(found))

    @cached_property
    def unit_pattern(self) -> str:
        """A pattern of units; longer ones first, since `px/s` begins with `px`."""
        return "|".join(sorted(self.units, key=lambda u: (-len(u), u)))


def keywords_of(grammar: str) -> set[str]:
    r"""The words of a grammar: quoted ones, and those of terminals that list words.

    >>> sorted(keywords_of('a: "size" B\nB.1: /(begins|ends)(?=\\s+when\\b)/\nNAME: /[a-z]\\w*/'))
    ['begins', 'ends', 'size', 'when']
    """
    code = "\n".join(line.split("//")[0] for line in grammar.split("\n") if "http" not in line)
    found = set(re.findall(r'"([a-z]{2,})"', code))
    for name, pattern in re.findall(r"^([A-Z_]+)(?:\.\d)?:\s*/(.*)/", code, re.MULTILINE):
        if name not in ("NAME", "UNIT", "COMMENT"):
            plain = re.sub(r"\\[a-zA-Z]|\[[^\]]*\]", " ", pattern).replace("times?", "times time")
            found.update(re.findall(r"[a-z]{2,}", plain))
    return found


SYNTAXES: Mapping[str, Syntax] = MappingProxyType(
    {
        "task": Syntax("task", tasks_grammar(), tuple(sorted(TERMS)), tuple(u for u in UNITS if u)),
        "rules": Syntax(
            "rules", rules_grammar(), (*SEVERITIES, "true", "false"), tuple(u for u in Unit if u)
        ),
    }
)


def vim(syntax: Syntax) -> str:
    """A syntax file for Vim and Neovim."""
    units = syntax.unit_pattern.replace("/", r"\/").replace("%", r"\%")
    stage = (
        r"syn match visupStage '<\s*\h\w*\s*\%(([^()<>]*)\s*\)\?>'" if syntax.name == "task" else ""
    )
    lines = (
        f'" visup {syntax.name} files; {_note("vim", syntax)}',
        "if exists('b:current_syntax') | finish | endif",
        r"syn match visupFunction '\<\h\w*\ze\s*('",
        rf"syn match visupNumber '\v<\d+(\.\d+)?([eE][-+]?\d+)?(\s*({units})(\w)@!)?'",
        stage,
        f"syn keyword visupKeyword {' '.join(syntax.keywords)}",
        f"syn keyword visupConstant {' '.join(syntax.constants)}",
        "syn match visupComment '#.*$'",
        'syn match visupString \'"[^"]*"\'',
        "hi def link visupComment Comment",
        "hi def link visupString String",
        "hi def link visupStage Identifier",
        "hi def link visupFunction Function",
        "hi def link visupNumber Number",
        "hi def link visupKeyword Keyword",
        "hi def link visupConstant Constant",
        "setlocal commentstring=#\\ %s",
        f"let b:current_syntax = 'visup_{syntax.name}'",
    )
    return "\n".join(line for line in lines if line) + "\n"


def emacs(syntax: Syntax) -> str:
    """A major mode for Emacs."""
    mode = f"visup-{syntax.name}-mode"
    stage = r'    ("<\\s-*[[:alpha:]_][[:alnum:]_]*\\s-*\\(?:([^()<>]*)\\s-*\\)?>" . font-lock-type-face)'
    lines = (
        f";;; {mode}.el --- visup {syntax.name} files -*- lexical-binding: t -*-",
        f";; {_note('emacs', syntax)}",
        f"(defconst {mode}-font-lock",
        "  `(",
        stage if syntax.name == "task" else "",
        f"    (,(regexp-opt '({_quoted(syntax.keywords)}) 'symbols) . font-lock-keyword-face)",
        f"    (,(regexp-opt '({_quoted(syntax.constants)}) 'symbols) . font-lock-constant-face)",
        r'    ("\\_<\\([[:alpha:]_][[:alnum:]_]*\\)\\s-*(" 1 font-lock-function-name-face)',
        f'    (,(concat "\\\\_<[0-9.]+\\\\s-*" (regexp-opt \'({_quoted(syntax.units)}))) . '
        "font-lock-constant-face)))",
        ";;;###autoload",
        f'(define-derived-mode {mode} prog-mode "visup {syntax.name}"',
        '  (modify-syntax-entry ?_ "w")',
        '  (modify-syntax-entry ?# "<")',
        '  (modify-syntax-entry ?\\n ">")',
        '  (modify-syntax-entry ?\\" "\\"")',
        '  (setq-local comment-start "# ")',
        f"  (setq-local font-lock-defaults (list {mode}-font-lock)))",
        ";;;###autoload",
        f"(add-to-list 'auto-mode-alist '(\"\\\\.{syntax.name}\\\\'\" . {mode}))",
        f"(provide '{mode})",
    )
    return "\n".join(line for line in lines if line) + "\n"


def highlightjs(syntax: Syntax) -> str:
    """A language for highlight.js: `hljs.registerLanguage("visup-task", ...)`."""
    words = {"keyword": list(syntax.keywords), "literal": list(syntax.constants)}
    number = rf"{NUMBER}\s*(?:{syntax.unit_pattern})?(?!\w)"
    modes = [
        '{ scope: "comment", begin: "#", end: "$" }',
        '{ scope: "string", begin: "\\"", end: "\\"|$" }',
        *([f'{{ scope: "section", begin: {json.dumps(STAGE)} }}'] if syntax.name == "task" else []),
        f'{{ scope: "number", begin: {json.dumps(number)} }}',
        r'{ scope: "title.function", begin: "\\b[A-Za-z_]\\w*(?=\\s*\\()", keywords: words }',
    ]
    return (
        f"// {_note('highlightjs', syntax)}\n"
        f"const words = {json.dumps(words)};\n"
        "module.exports = () => ({\n"
        f'  name: "visup {syntax.name}",\n'
        "  keywords: words,\n"
        f"  contains: [\n    {(',' + chr(10) + '    ').join(modes)}\n  ],\n"
        "});\n"
    )


EDITORS: Mapping[str, Callable[[Syntax], str]] = MappingProxyType(
    {"vim": vim, "emacs": emacs, "highlightjs": highlightjs}
)
"""Editor -> function that writes its syntax file."""


def _note(editor: str, syntax: Syntax) -> str:
    return _NOTE.format(editor=editor, language=syntax.name)


def _quoted(words: tuple[str, ...]) -> str:
    return " ".join(f'"{w}"' for w in words)
