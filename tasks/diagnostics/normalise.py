"""Normalises characters: look-alikes are reported and replaced by the intended ones."""

from __future__ import annotations

import re

from visup.agent.model.errors import SourceLocation
from visup.rules.language.diagnostics import Diagnostic, Source

COMMENT = re.compile(r"#.*")
TEXT = re.compile(r"""(?:::=|\binclude\b)\s*("[^"\n]*"|[“”„«][^“”»"\n]*[“”»])""")
OWN_LINE = re.compile(r"""\s*("[^"\n]*"|[“”„«][^“”»"\n]*[“”»])""")

LOOKALIKES = {
    "：": ":", "＝": "=", "＜": "<", "＞": ">", "（": "(", "）": ")", "，": ",", "｜": "|",
    "＊": "*", "＋": "+", "？": "?", "＆": "&", "‹": "<", "›": ">", "⟨": "<", "⟩": ">",
    "〈": "<", "〉": ">", "¦": "|", "∣": "|", "\u00a0": " ", "\u2009": " ", "\u202f": " ",
    "\u200b": " ", "\ufeff": " ", "\u3000": " ", "–": "-", "—": "-", "−": "-",
}  # fmt: skip
QUOTES = "\"'`“”‘’„‚«»′″"
UNUSUAL = re.compile(r"[#\x00-\x0c\x0e-\x1f\x7f\"'`]")


def normalise(text: str, source: Source) -> tuple[str, list[Diagnostic]]:
    """Normalise a text, so that odd characters do not hide other mistakes.

    Args:
        text: The original text.
        source: For positions.

    Returns:
        Text of the same length with tabs, quotes and typographic characters replaced and comments blanked;
        and one fault for each run of odd characters.
    """
    faults: list[Diagnostic] = []
    lines = text.split("\n")
    before = ""
    for number, line in enumerate(lines, 1):
        if line.isascii() and not UNUSUAL.search(line):
            code = line
        else:
            code = _clean_line(line, before, number, source, faults)
        lines[number - 1] = code
        before = code if code.strip() else before
    return "\n".join(lines), _one_for_tabs(faults)


def _clean_line(
    line: str, before: str, number: int, source: Source, faults: list[Diagnostic]
) -> str:
    """The normalised line; each kind of odd character is reported once per line."""
    text = _text_in(line, before)
    if text is None:
        code = COMMENT.sub(lambda m: " " * len(m[0]), line)
        return _clean_code(code, 0, number, source, faults)
    start, end = text.span(1)
    if text[1][0] != '"':
        what = f"typographic quotes `{text[1][0]}`"
        place = source.place(number, start + 1, end - start)
        faults.append(Diagnostic("E105", what, place, expected='`"` on both sides'))
    said = "".join(" " if _odd(c) in ("E104", "E106") else c for c in line[start + 1 : end - 1])
    rest = COMMENT.sub(lambda m: " " * len(m[0]), line[end:])
    first = _clean_code(line[:start], 0, number, source, faults)
    return f'{first}"{said}"' + _clean_code(rest, end, number, source, faults)


def _text_in(line: str, before: str) -> re.Match[str] | None:
    """The quoted text of a line where one is allowed: after `::=` and `include`."""
    found = TEXT.search(line) or (OWN_LINE.match(line) if before.endswith("::=") else None)
    return None if found is None or "#" in line[: found.start(1)] else found


def _clean_code(
    code: str, offset: int, number: int, source: Source, faults: list[Diagnostic]
) -> str:
    reported = set()
    for i, char in enumerate(code):
        kind = _odd(char)
        quoted = kind == "E105" and char in QUOTES
        if kind and (kind, quoted) not in reported:
            reported.add((kind, quoted))
            length = _quoted(code, i) if quoted else 1
            faults.append(_odd_fault(kind, char, source.place(number, offset + i + 1, length)))
    return "".join(_meant(c) if _odd(c) else c for c in code)


def _quoted(line: str, start: int) -> int:
    """Number of characters from one quote to the next, inclusive."""
    ends = (i for i in range(start + 1, len(line)) if line[i] in QUOTES)
    return next(ends, start) - start + 1


def _odd(char: str) -> str:
    if char == "\t":
        return "E106"
    if char in QUOTES or char in LOOKALIKES:
        return "E105"
    if (char < " " and char != "\r") or char in "\x7f\ufffd":
        return "E104"
    return ""


def _meant(char: str) -> str:
    return LOOKALIKES.get(char, " ")


def _odd_fault(code: str, char: str, place: SourceLocation) -> Diagnostic:
    if code == "E106":
        return Diagnostic(code, "a tab", place, expected="spaces", hint="use spaces")
    if code == "E104":
        return Diagnostic(code, f"a character that is not text (U+{ord(char):04X})", place)
    if char in QUOTES:
        what = "typographic quotes" if ord(char) > 127 else "quotes"
        hint = "names are written without quotes"
        return Diagnostic(code, f"{what} `{char}`", place, expected="a name", hint=hint)
    plain = LOOKALIKES[char]
    shown = "an ordinary space" if plain == " " else f"`{plain}`"
    what = f"`{char}` (U+{ord(char):04X}) only looks like {shown}"
    return Diagnostic(code, what, place, expected=shown, hint="type it on the keyboard")


def _one_for_tabs(faults: list[Diagnostic]) -> list[Diagnostic]:
    """Report all tabs of a file once."""
    tabs = [f for f in faults if f.code == "E106"]
    if len(tabs) < 2:
        return faults
    lines = len({f.place.line for f in tabs})
    what = f"tabs, here and in {lines} lines" if lines > 1 else "tabs"
    first = Diagnostic("E106", what, tabs[0].place, expected="spaces", hint="use spaces")
    return [first if f is tabs[0] else f for f in faults if f is tabs[0] or f.code != "E106"]
