"""Constructs of other languages and tools, translated to the task language.

Behaviour trees, extended BNF, Python and data files have other notations for what a task file can express.
Each construct is translated as a whole, so that none of its parts are lost.
"""

from __future__ import annotations

import re
from math import degrees

from visup.rules.correction.everyday_phrases import AMOUNT_SAID, amount_said
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.checks.edit_costs import plain_call
from visup.tasks.checks.usual_meanings import (
    CALL,
    CONDITION_KIND,
    COUNT_WORDS,
    ITEM,
    TIME,
    UsualMeaning,
    usual,
)
from visup.tasks.grammar.statement import NAME

_NODES = {
    "{} {}": "sequence|seq|sequential|steps|chain|series|inorder|in_order|serial",
    "({} | {})": "fallback|selector|choice|oneof|one_of|either|alternative|alternatives|or|any|anyof|any_of",
    "{} & {}": "parallel|par|concurrent|simultaneous|simultaneously|both|together|and|all|allof|all_of",
    "any order ({}, {})": "unordered|anyorder|any_order|permutation|interleave|shuffle|free_order",
}
_COMPOSED = {word: form for form, words in _NODES.items() for word in words.split("|")}
"""Composite nodes of other tools -> notation for two children."""
_UNITS = r"[a-z%][a-z/%]*"
_AMOUNT = rf"[\d.]+\s*(?:{_UNITS})?"
_SECONDS = {"s": 1, "m": 60, "h": 3600}
_CLAUSES = (
    r"(?=\s*(?:$|[|&)]|\b(?:for|within|after|at|every|ends|begins|fails|pauses|progresses)\b))"
)
_FALSE = ("false", "off", "no", "0")
_TRUE = ("true", "on", "yes", "1")


def _tree_node(match: re.Match[str]) -> str:
    """A node of a behaviour tree with its children, in the notation of tasks."""
    form = _COMPOSED.get(match[1].casefold().removesuffix("node"))
    if form is None:
        return match[0]
    before, between, after = form.split("{}")
    return before + between.join(re.findall(ITEM, match[2])) + after


def _repetition(match: re.Match[str]) -> str:
    """A count in braces after an item: `{3}`, `{2,4}`, `{2,}`."""
    least, comma, most = match[2], match[3], match[4]
    upper = "" if comma and not most else f" at most {most or least} times"
    return f"{match[1]} at least {least} times{upper}"


def _in_range(match: re.Match[str]) -> str:
    """A range in brackets or between two comparison signs; one unit may apply to both bounds."""
    low, high = match["low"], match["high"]
    unit = match["low_unit"] or match["high_unit"] or match.groupdict().get("unit") or ""
    upper = match["high_unit"] or match.groupdict().get("unit") or unit
    return f"{match['what']} between {low} {match['low_unit'] or unit} and {high} {upper}"


def _seconds(match: re.Match[str]) -> str:
    """Consecutive amounts of time, added up (`1 min 30 s`)."""
    parts = re.findall(r"([\d.]+)\s*([a-z]+)", match[2])
    return f"{match[1]} {sum(float(n) * _SECONDS[unit[0]] for n, unit in parts):g} s"


def _zone_corners(match: re.Match[str]) -> str:
    """The corners of a zone, from a list of corners or from a box."""
    numbers = re.findall(r"[\d.]+", match[2])
    if len(numbers) == 4:
        x, y, right, low = map(float, numbers)
        if re.search(r"\b(?:w|width|h|height|size)\b", match[2]):
            right, low = x + right, y + low
        numbers = [f"{n:g}" for n in (x, y, right, y, right, low, x, low)]
    if len(numbers) < 6 or len(numbers) % 2:
        return match[0]
    pairs = zip(numbers[::2], numbers[1::2], strict=True)
    return f"zone {match[1]} is {' '.join(f'({x}, {y})' for x, y in pairs)}"


def _period(match: re.Match[str]) -> str:
    """A period with a tolerance (`every 5 s +/- 1 s`)."""
    middle, unit, by = float(match[2]), match[3] or match[5], float(match[4])
    return f"{match[1]} {max(0.0, middle - by):g} {unit} to {middle + by:g} {unit}"


def _declarations(word: str, match: re.Match[str]) -> str:
    """One declaration for each name of a list."""
    return " ".join(f"{word} {name}" for name in re.findall(NAME, match[1]) if name != "and")


def _signal_condition(match: re.Match[str]) -> str:
    """A signal compared with a word."""
    if match[2].casefold() in _TRUE:
        return f"signal_on({match[1]})"
    return match[0] if match[2].casefold() in _FALSE else f"signal_is({match[1]}, {match[2]})"


def _joined_stage_names(match: re.Match[str]) -> str:
    """A line with blanks and dashes in its stage names replaced, if several names have them."""
    new = re.sub(r"<\s*([\w .\-]+?)\s*>", lambda m: f"<{re.sub(r'[ .-]+', '_', m[1])}>", match[0])
    several = sum(a != b for a, b in zip(match[0].split("<"), new.split("<"), strict=True)) > 1
    return new if several else match[0]


def _invariant(match: re.Match[str]) -> str:
    """An invariant with a colon, or with `while` in place of `during`."""
    condition = re.sub(r"\b(?:while|in|at|when)\s+(?=<)", "during ", match[2])
    return f"{match[1]} {condition}"


FOREIGN_FORMS: tuple[UsualMeaning, ...] = (
    usual("E101 E103 E117 E119 E123 E201 E135",
          rf"\b({NAME})\s*\(\s*({ITEM}(?:\s*,\s*{ITEM})+)\s*\)", _tree_node),
    usual("E101 E103 E112 E119", rf"\b({NAME})\s*\{{\s*({ITEM}(?:\s*[,;]?\s*{ITEM})+)\s*\}}", _tree_node),
    usual("E112", rf"({ITEM}|\))\s*\{{\s*(\d+)\s*(,)?\s*(\d+)?\s*\}}", _repetition),
    usual("E101 E103 E112 E119",
          rf"(?P<what>{CALL})\s+in\s*[\[(]\s*(?P<low>[\d.]+)\s*(?P<low_unit>{_UNITS})?\s*(?:,|;|-|\.\.)\s*"
          rf"(?P<high>[\d.]+)\s*(?P<high_unit>{_UNITS})?\s*[\])]\s*(?P<unit>px/s|px|%|deg/s|deg|mm|cm|m|s)?",
          _in_range),
    usual("E101 E103 E107 E119 E116",
          rf"(?P<low>[\d.]+)\s*(?P<low_unit>{_UNITS})?\s*<=?\s*(?P<what>{CALL})\s*<=?\s*(?P<high>[\d.]+)\s*"
          rf"(?P<high_unit>{_UNITS})?", _in_range),
    usual("E101", rf"({CALL})\s+(for\s+{TIME})\s*([<>]=?\s*{_AMOUNT})", r"\1 \3 \2"),
    usual("E101 E103 E119 E127", rf"\b(?:timeout|time_?limit|deadline|max_?time)\s*[=:]?\s*({TIME})",
          r"within \1"),
    usual("E101 E103 E119 E127", rf"\b(?:duration|hold_?time|dwell)\s*[=:]?\s*({TIME})", r"for \1"),
    usual("E101 E103 E119 E218 E116",
          r"\b(for|within|after)\s+((?:[\d.]+\s*[hms][a-z]*\s*(?:,|and)?\s*){2,3})(?<!\s)", _seconds),
    usual("E218", r"([\d.]+)\s*rad(?:ians?)?\b\s*(/s)?",
          lambda m: f"{degrees(float(m[1])):.3g} deg{m[2] or ''}"),
    usual("E122 E218 E116", r"\b(px|deg|m)\s*/\s*(?:s|sec|second)\b", r"\1/s"),
    usual("E124",
          rf"\b(actor\s+{NAME}\s+is)\s+(?:(?:an?|the|of|with|bright|vivid|pale|deep|colou?r(?:ed)?)\s+)+(?=\w)",
          r"\1 "),
    usual("E131", rf"\bzone\s+({NAME})\b(.*)$", _zone_corners),
    usual("E124 E127 E103", rf"^\s*actors?\s*:?\s*({NAME}(?:\s*(?:,|\band\b)\s*{NAME})+)\s*$",
          lambda m: _declarations("actor", m)),
    usual("E124 E127 E103", rf"^\s*bystanders?\s*:?\s*({NAME}(?:\s*(?:,|\band\b)\s*{NAME})*)\s*$",
          lambda m: _declarations("bystander", m)),
    usual("E101 E127 E130", r"^\s*(?:import|use|using|load|include|require)\s+[\"'<]?([\w./-]+)[\"'>]?\s*$",
          r'include "\1"'),
    usual("E101 E127 E130 E221",
          r"^\s*(?:import|use|using|load|include|require)\s+[\"'<]?([\w/-]+)(?:\.\w+)?[\"'>]?\s*$",
          r'include "\1"'),
    usual("E101 E103",
          rf"\bsignal\(\s*[\"']?({NAME})[\"']?\s*\)\s*(?:={{1,3}}|\bis\b)\s*[\"']?({NAME})[\"']?",
          _signal_condition),
    usual("E101 E103 E116 E119 E219", rf"\bsignal\s+({NAME})(?=\s*[<>])", r"signal(\1)"),
    # A signal needs no declaration.
    usual("E101", rf"^\s*signals?\s*:?\s+({NAME}(?:\s*,\s*{NAME})*)\s*$", r"# given as a signal: \1"),
    usual("E133 E101", rf"\bwhen\s+(not\s+)?({NAME})\b(?!\s*[\w(<>.])", r"when \1signal_on(\2)"),
    usual("E107 E101 E103", rf"(?<=::=)\s*({NAME})(?=\s*[<>]=?\s*[\d.])", r" signal(\1)"),
    usual("E101 E201 E205", rf"\b({NAME})\.({NAME})\(\s*({NAME})\s*\)", r"\2(\1, \3)"),
    usual("E101 E201 E205", rf"\b({NAME})\.({NAME})\(\s*\)", r"\2(\1)"),
    usual("E101", rf"\b({NAME})\.({NAME})\b(?!\s*\()", r"\2 of \1"),
    usual("E127 E101 E103", rf"::=\s*pauses?\s+(?:while|when|if)\s+({CALL})\s*:?\s*(\(.*\)|{ITEM})\s*$",
          r"::= \2 pauses when \1"),
    usual("E101 E125 E127", r"^\s*(never|always)\s*:\s*(.*)$", _invariant),
    usual("E125 E127", r"^\s*(never|always)\b\s*(.*)$", _invariant),
    usual("E101 E119 E125 E103", r"\bduring\s+(<[^<>]*>(?:\s*(?:,|&|\||\band\b|\bor\b)?\s*<[^<>]*>)+)",
          lambda m: f"during {' or '.join(re.findall(r'<[^<>]*>', m[1]))}"),
    usual("E101 E103 E117 E119", rf"\b({NAME})\s+of\s+({NAME})\s+of\s+({NAME})\b(.*)$",
          r"\1 of \2\4 actor \2 is part of \3"),
    usual("E101 E103 E119", r"(?:^|(?<=[\s=]))\d+[.)]\s*(?=[<\w])[^\n]*",
          lambda m: re.sub(r"(?:^|(?<=\s))\d+[.)]\s*(?=[<\w])", "", m[0])),
    usual("E101 E103 E115 E119", AMOUNT_SAID.pattern, amount_said),
    usual("E116", r"([<>]=?)\s*(0?\.\d+)(?![\w.%]|\s*[a-z%])", lambda m: f"{m[1]} {100 * float(m[2]):g} %"),
    usual("E101 E103 E104 E116 E218", r"([\d.]+)\s*(?:°|degrees?\b)\s*(/s)?", r"\1 deg\2"),
    usual("E101 E103 E119", rf"({ITEM})\s*[x×*]\s*(\d+)\b", r"\1 at least \2 times at most \2 times"),
    usual("E228", rf"({CALL})\s*>=?\s*({TIME})", r"\1 for \2"),
    usual("E228", rf"({CALL})\s*<=?\s*({TIME})", r"\1 within \2"),
    usual("E101 E103 E119",
          rf"({ITEM})\s+(?:max(?:imum)?|at\s+most|no\s+more\s+than|up\s+to|under|in)\s+({TIME})",
          r"\1 within \2"),
    usual("E101 E103 E119 E134",
          rf"({ITEM})\s+(?:min(?:imum)?|at\s+least|no\s+less\s+than|over)\s+({TIME})", r"\1 for \2"),
    usual("E124", rf"\bactor\s+({NAME})\s+is\s+optional\b", r"optional actor \1 is \1"),
    usual("E127 E101",
          rf"\b(?:while|as\s+long\s+as|until)\s+[\w ]*?:?\s*(<\s*{NAME}\s*\(\s*({NAME})\s*\)\s*>)",
          r"for each new \2 \1"),
    usual("E101 E103", rf"^\s*task\s+({NAME})\s*(?=::=|:|=)", r"task <\1> "),
    usual("E101 E103",
          rf"^\s*({NAME})\s+(?:must\s+|may\s+|is\s+|should\s+)?(never|always)\s+(?:be\s+)?({NAME})"
          rf"\s+(?:the\s+)?({NAME})\s*$",
          lambda m: f"{m[2]} {synonym(m[3], ACTIONS) or m[3]}({m[1]}, {m[4]})"),
    usual("E101 E103 E119", r"\b(every)\s+([\d.]+)\s*(s|ms|min|h)?\s*(?:\+/?-|±)\s*([\d.]+)\s*(s|ms|min|h)?",
          _period),
    usual("E101 E103 E119 E127", rf"({ITEM})\s+(?:before|not\s+later\s+than|by)\s+({TIME})",
          r"\1 within \2"),
    usual("E101 E127 E133", rf"\b({CONDITION_KIND})\s*(?::|=)\s*(?:when\s+)?(?=\w)", r"\1 when "),
    usual("E101 E103 E119 E134", rf"({ITEM})\s+(?:exactly|only|just)?\s*(once|twice|thrice)\b",
          lambda m: f"{m[1]} at least {COUNT_WORDS[m[2]]} at most {COUNT_WORDS[m[2]]}"),
    usual("E108 E101 E103 E202", rf"<\s*(?:wait|delay|pause|sleep)[_ ]*(?:for[_ ]*)?({TIME})\s*>\s*({ITEM})",
          r"\2 after \1"),
    usual("E101 E103 E124", rf"\b(actor\s+{NAME}.*?\bat)\s*\[?\s*([\d.]+)\s*,\s*([\d.]+)\s*\]?",
          r"\1 (\2, \3)"),
    usual("E101 E124 E103",
          r"\bwhat\s+(?:comes|came|drives|moves|enters)\s+(?:in\s+)?(?:from|on|at)\s+(?:the\s+)?"
          r"(left|right|top|bottom)\b(?:\s+(?:side|edge|border))?", r"what enters from the \1"),
    usual("E101 E103", r"^\s*(during\s+<[^:]*>)\s*[:,]?\s*((?:never|always)\b.*?)\s*$", r"\2 \1"),
    usual("E136", r"=\s*\(\s*[\d.]+\s*,.*$",
          lambda m: re.sub(r"=\s*\(\s*([\d.]+)\s*,\s*([\d.]+)\s*\)", r"= (\1 m, \2 m)", m[0])),
    usual("E101 E119", r"\(\s*(<[^()]*>(?:\s*,\s*<[^()]*>)+)\s*\)\s*[x×*]\s*(\d+)",
          lambda m: f"({m[1].replace(',', '')}) at least {m[2]} times at most {m[2]} times"),
    usual("E108", r"[^\n]*<[^\n]*", _joined_stage_names),
    usual("E101 E103 E201 E219 E119", rf"(?<=::=)\s*((?:{NAME}\s+){{1,7}}?{NAME}){_CLAUSES}",
          lambda m: f" {plain_call(m[1])}"),
)  # fmt: skip
"""Tried in this order."""
