"""Frequent slips in the rule language, and their corrections."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from math import degrees

from visup.agent.model.did_you_mean import closest
from visup.rules.correction.everyday_phrases import AMOUNT_SAID, amount_said
from visup.rules.language.keywords import KEYWORDS
from visup.rules.language.synonyms import meant_word, synonym
from visup.rules.predicates.vocabulary import RULES


@dataclass(frozen=True, slots=True)
class MistakePattern:
    """A frequent slip.

    Attributes:
        pattern: Pattern of the slip.
        new: Its correction; a template as for `re.Match.expand`, or a function of the match.
    """

    pattern: str
    new: str | Callable[[re.Match[str]], str]

    def found(self, text: str, begin: int, end: int) -> Iterator[re.Match[str]]:
        """Where the pattern is found in a part of a text."""
        return _compiled(self.pattern).finditer(text, begin, end)


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    """Compiled when it is first needed: there are hundreds, and most processes read no mistake."""
    return re.compile(pattern, re.MULTILINE)


def _fix(pattern: str, new: str | Callable[[re.Match[str]], str]) -> MistakePattern:
    return MistakePattern(pattern, new)


WORDS_OF_PAIRS = (
    "touching",
    "converging",
    "diverging",
    "coupled",
    "moving_together",
    "overlapping",
)
_CALL = r"\w+\([^()]*\)"
_AMOUNT = r"-?[\d.]+ ?(?:px/s2|px/s|px|%|ms|min|mm|m/s|m|cm|s|h|deg/s|deg|/s)?"


def _some_of(least: int, parts: list[str]) -> str:
    """That at least some of several are true, in the rule language."""
    return f"({' or '.join(' and '.join(some) for some in combinations(parts, least))})"


_WORD = re.compile(r"[A-Za-z_]\w*")
_NUMBER, _UNIT = r"-?\d+(?:\.\d+)?", r"px/s2|px/s|px|%|ms|min|mm|m/s|m|cm|s|h|deg/s|deg|/s"
_RANGE = (
    rf"(?P<low>{_NUMBER})\s*(?P<unit>{_UNIT})?\s*(?:\band\b|\bto\b|&|,|;|-|\.\.)\s*"
    rf"(?P<high>{_NUMBER}(?:\s*(?:{_UNIT})(?![\w/]))?)"
)
_ON = r"(touching(\1, \2) and north_of(\1, \2))"
_QUOTES = "[\"'`\u201c\u201d\u201e\u00ab\u00bb]"
_QUANTIFIED = r"\b(exists|forall)\s+"


def _in_range(match: re.Match[str]) -> str:
    """A quantity within a range, or outside it; a number without a unit has that of the other one."""
    what, high = match["what"], match["high"]
    unit = match["unit"] or re.sub(rf"^{_NUMBER}\s*", "", high)
    high = high if re.search(r"[a-z%]", high) else f"{high} {unit}".rstrip()
    low = f"{match['low']} {unit}".rstrip()
    within = f"{what} >= {low} and {what} <= {high}"
    return f"not ({within})" if match["no"] else _grouped(match, within)


_BEGINS = re.compile(r"(?:\b(?:when|unless|and|or)\s*|[:(,]\s*|^\s*)\Z", re.MULTILINE)
_ENDS = re.compile(r"\s*(?:\Z|$|[),]|\b(?:and|or|unless|hold|say)\b)", re.MULTILINE)


def _grouped(match: re.Match[str], both: str) -> str:
    """Two conditions joined by `and`, in parentheses where `not`, `for 2 s` or the like is about both."""
    begins = _BEGINS.search(match.string[: match.start()])
    alone = begins and _ENDS.match(match.string, match.end())
    return both if alone else f"({both})"


_SIGNS = {"&&": "and", "||": "or", "∧": "and", "∨": "or", "¬": "not", "!": "not"}
_SIGN = r"(?:&&|\|\||∧|∨|¬|!(?!=))"
_A_SIGN = re.compile(rf"\s*({_SIGN})\s*")


def _signs_in_words(match: re.Match[str]) -> str:
    """All signs of logic of a line as words."""
    said = _A_SIGN.sub(lambda m: f" {_SIGNS[m[1]]} ", match[0])
    return said if match.string[: match.start()][-1:] not in ("", " ", "(", "\n") else said.lstrip()


def _of_signal(match: re.Match[str]) -> str:
    """A signal compared with a word: whether it is on, off, or has that word as its value."""
    off = match["word"].casefold() in ("false", "off", "no", "closed")
    plain = off or match["word"].casefold() in ("true", "on", "yes")
    said = (
        f"signal_on({match['name']})" if plain else f"signal_is({match['name']}, {match['word']})"
    )
    return (
        f"not {said}" if off != (match["sign"].startswith("!") or "not" in match["sign"]) else said
    )


def _behind(match: re.Match[str]) -> str:
    """An argument that stands behind its bracket."""
    kinds = RULES.predicates[match[1]].argument_kinds if match[1] in RULES.predicates else ()
    return f"{match[1]}({match[2]}, {match[3]})" if len(kinds) == 2 else match[0]


def _pronoun(match: re.Match[str]) -> str:
    """What somebody or nobody does with an object."""
    verb = meant_word(match["verb"], RULES.predicates)
    said = f"(exists other: {verb}(other, {match['what']}))"
    return f"not {said}" if match["who"].casefold().startswith("no") else said


def _changing(match: re.Match[str]) -> str:
    """A quantity that grows or shrinks."""
    return f"rate({match[1]}, 1 s) {'>' if re.match('inc|gro|ris|gain|spe', match[2]) else '<'} 0"


def _counted(match: re.Match[str]) -> str:
    """The number of objects, or of those of a name in the plural."""
    kind = match["kind"]
    if kind in ("objects", "things", "bodies", "object"):
        return "objects()"
    return f"objects_named({kind.removesuffix('s') if len(kind) > 3 else kind})"


def _being(match: re.Match[str]) -> str:
    """`a is arm`: an object of a name, unless it is a word of the language."""
    name = match["name"]
    known = (
        name in KEYWORDS or name in RULES.predicates or synonym(name, RULES.predicates) is not None
    )
    said = f"named({match['what']}, {name})"
    return match[0] if known or name == "another" else f"not {said}" if match["no"] else said


MISTAKE_PATTERNS = (
    _fix(rf"{_SIGN}(?:[^\n#\"]*{_SIGN})?\s*", _signs_in_words),
    _fix(r"\bsignal\(\s*\"?(?P<name>\w+)\"?\s*\)\s*(?P<sign>={1,3}|!=|is\s+not\b|is\b)\s*[\"']?"
          r"(?P<word>[A-Za-z]\w*)[\"']?", _of_signal),
    _fix(r"(?<=[(,])(\s*)[\"'](\w+)[\"'](?=\s*[,)])", r"\1\2"),
    _fix(AMOUNT_SAID.pattern, amount_said),
    _fix(r"=>\s*(?=\d)", ">= "),
    _fix(rf"({_CALL})\s+U\s+(?=[\w(])", r"\1 until[5 s] "),
    _fix(rf"({_CALL})\s+S\s+(?=[\w(])", r"\1 since "),
    _fix(r"\bin\s+(\d+)\s+(?:out\s+)?of\s+(?:the\s+)?(?:last\s+|past\s+|previous\s+)?(\d+)\s*(?:frames?|images?|times)\b",
          r"in \1 of \2 samples"),
    _fix(r"\bin\s+(\d+)\s+(?:out\s+)?of\s+(?:the\s+)?(?:last|past|previous)\s+(\d+)\s*(?:samples?\b)?",
          r"in \1 of \2 samples"),
    _fix(r"\b(?:changes|changed|toggles|edge|flips)\((\w+\([^()]*\))\)", r"(rising(\1) or falling(\1))"),
    _fix(r"\b(\w+)\((\w+)\)\s+(?:the\s+)?(?!(?:and|or|for|in|within|since|until|unless|hold|say|implies|iff|xor|leave|release|cooldown)\b)"
          r"([a-z]\w*)\b(?!\s*[(\w])", _behind),
    _fix(rf"({_CALL})\s+(?:is\s+|keeps\s+)?(increas\w+|grow\w*|ris(?:es|ing)|gains|speeds\s+up|decreas\w+|shrink\w*"
          r"|fall(?:s|ing)|drop\w*|slows(?:\s+down)?)(?!\s*\()", _changing),
    _fix(r"\b(?P<who>nobody|nothing|no\s?one|none|somebody|someone|something|anybody|anything|anyone)\s+(?:is\s+)?"
          r"(?P<verb>[a-z]\w+)\s+(?:with\s+|by\s+|to\s+)?(?P<what>[a-z]\w?)\b", _pronoun),
    _fix(r"\b[a-z]+(?:-[a-z]+)+(?=\()", lambda m: m[0].replace("-", "_")),
    _fix(rf"\|\s*({_CALL})\s*\|", r"abs(\1)"),
    _fix(rf"\b(max|min)\(\s*({_CALL})\s*,\s*(\d[\d.]*\s*(?:ms|s|min|h))\s*\)",
          lambda m: f"{'highest' if m[1] == 'max' else 'lowest'}({m[2]}, {m[3]})"),
    _fix(rf"({_CALL})\.(rate|before|lowest|highest)\(\s*({_AMOUNT})?\s*\)",
          lambda m: f"{m[2]}({m[1]}, {m[3] or '1 s'})"),
    _fix(rf"({_CALL})\s+(?:and\s+)?then\s+({_CALL})\s+within\s+({_AMOUNT})", r"\1 and eventually[\3] \2"),
    _fix(rf"({_CALL})\s+(?:right\s+|just\s+)?after\s+({_CALL})", r"\1 and once \2"),
    _fix(rf"({_CALL})\s+since\s+(\d[\d.]*\s*(?:ms|s|min|h))\b(?!\s*[\w(])", r"\1 for \2"),
    _fix(rf"({_CALL})\s+(\d[\d.]*\s*(?:ms|s|min|h))\s+(?:long|straight|in\s+a\s+row)\b", r"\1 for \2"),
    _fix(r"(?<=[(,])(\s*)(?:the\s+|zone\s+|object\s+)+(?=\w+\s*[,)])", r"\1"),
    _fix(rf"({_CALL})\s*={{1,3}}\s*({_NUMBER})\s*(?:\+/?-|±)\s*({_NUMBER})\s*({_UNIT})",
          lambda m: _grouped(m, f"{m[1]} >= {float(m[2]) - float(m[3]):g} {m[4]} and "
                             f"{m[1]} <= {float(m[2]) + float(m[3]):g} {m[4]}")),
    _fix(r"\bexpected\(\s*(\w+)\s*\(([^()]*)\)\s*\)", r"expected(\1, \2)"),
    _fix(r"\b(?:the\s+)?(?:number|count|amount)[ _]+of[ _]+(?P<kind>[a-z]\w*)(?:\(\))?", _counted),
    _fix(r"\bd\s*/\s*dt\s*\(?(\w+\([^()]*\))\)?", r"rate(\1, 1 s)"),
    _fix(rf"\b(rate|before|lowest|highest|last)\(\s*({_AMOUNT})\s*,\s*([^()]*(?:\([^()]*\))?)\s*\)",
          r"\1(\3, \2)"),
    _fix(r"\b([a-z]\w*)\.(?:pos(?:ition)?\.)?([xy])\b", r"position_\2(\1)"),
    _fix(r"^(\s*)(unless\s+[^\n]+)\n(\s*)(when\s+[^\n]+)", r"\1\4\n\3\2"),
    _fix(r"\b(rule\s+\w+)[ -]+(\w+)(?=\()", r"\1_\2"),
    _fix(r"\b([a-z]\w*)\s+is\s+(?!not\b)([a-z]\w*)\s+(and|or|but)\s+([a-z]\w*)\s+is(?:n't|\s+not)\b(?!\s+[a-z]\w*\s*(?:and|or|$))",
          r"\2(\1) \3 not \2(\4)"),
    _fix(r"\b(?P<what>[a-z]\w?)\s+(?:is|==)\s+(?P<no>not\s+)?(?:an?\s+|the\s+)?\"?(?P<name>[a-z]\w{2,})\"?(?!\s*\()",
          _being),
    _fix(r"\b([a-z]\w?)\s+(?:is\s+)?(not\s+)?(?:in|inside|within)\s+(?:the\s+)?(?:zone\s+)?([a-z_]\w*)\b(?!\s*[(:])",
          lambda m: f"{'not ' if m[2] else ''}inside({m[1]}, {m[3]})"),
    _fix(rf"(?P<what>{_CALL})\s+(?:is\s+|stays\s+|lies\s+)?(?P<no>not\s+)?(?:in\s+)?(?:between|from)\s*"
          rf"(?P<open>[\[(])?\s*{_RANGE}(?(open)\s*[\])])", _in_range),
    _fix(rf"(?P<no>\bnot\s+)?\bbetween\(\s*(?P<what>{_CALL})\s*,\s*{_RANGE}\s*\)", _in_range),
    _fix(rf"{_QUANTIFIED}(\w+)\s*(?:!=|<>|≠|(?:is\s+)?not|other\s+than|(?:different|distinct)\s+from)\s*\w+\s*:",
          r"\1 \2:"),
    _fix(rf"{_QUANTIFIED}(\w+)\s*(?:,|and|&)\s*(\w+)\s*:", r"\1 \2: \1 \3:"),
    _fix(r"\b(exists|forall)\s*\(\s*(\w+)\s*\)\s*:?\s*(?=\w)", r"\1 \2: "),
    _fix(rf"{_QUANTIFIED}(?:an?|any|some|one|another|objects?|things?|bod(?:y|ies))\s+(\w+)"
          r"(?=\s*(?::|\bsuch\b|\bwhere\b|\bwith\b))", r"\1 \2"),
    _fix(r"\b([a-z_]{3,})\s+(?:between|of|from)\s+(\w+)\s+(?:and|to|,)\s*(\w+)(?=\s*[<>=])", r"\1(\2, \3)"),
    _fix(r"\b(signal(?:_on|_is|_known)?\(\s*\w+)\s+(\w+)", r"\1_\2"),
    _fix(r"∃\s*(?=\w)", "exists "),
    _fix(r"∀\s*(?=\w)", "forall "),
    _fix(r"\bon(?:[ _]?top(?:[ _]of)?)?\(\s*(\w+)\s*,\s*(\w+)\s*\)", _ON),
    _fix(r"\b(?!(?:and|or|not|when|unless)\b)(\w+)\s+(?:is\s+|sits\s+|lies\s+|rests\s+)?on(?:\s+top\s+of|to)?"
          r"\s+(\w+)\b(?!\s*\()", _ON),
    _fix(r"\b(?:self|this|math|np|numpy|visup|rules|stl)\.(?=\w+\s*\()", ""),
    _fix(rf"({_CALL})\s*(?:===?|=|>=?)\s*1(?![\d.])", r"\1"),
    _fix(rf"({_CALL})\s*>\s*0(?![\d.])", r"\1"),
    _fix(rf"({_CALL})\s*(?:===?|=)\s*0(?![\d.])", r"not \1"),
    _fix(r"\b([a-z]\w?)(?:->|\.)([a-z_]{3,})\b(?:\(\))?(?!\s*\()", r"\2(\1)"),
    _fix(r"\b(exists|forall)\(\s*(\w+)\s*[,:]\s*", r"(\1 \2: "),
    _fix(r"\bfor\s+(?:any\s+|some\s+)?(\w+)\s+in\s+\w+\s*:", r"exists \1:"),
    _fix(r"\bno\s+(\w+)\s*:", r"not exists \1:"),
    _fix(r"\b(?:stopped|resting|still|stationary|at_rest|standing|static)\((\w+)\)", r"not moving(\1)"),
    _fix(r"\b(?:derivative|deriv|diff|gradient|delta)\(((?:[^()]|\([^()]*\))*)\)", r"rate(\1, 1 s)"),
    _fix(r"\b(when|and|or|not|unless)\s+until\b", r"\1 eventually"),
    _fix(r"\blambda\b[^:\n]*:\s*", ""),
    _fix(r"(?<=[(,])(\s*)\w+\s*=\s*(?=\w+\s*[,)])", r"\1"),
    _fix(rf"\bany\(\s*({_CALL})\s+for\s+(\w+)\s+in\s+\w+(?:\(\))?\s*\)", r"(exists \2: \1)"),
    _fix(rf"\ball\(\s*({_CALL})\s+for\s+(\w+)\s+in\s+\w+(?:\(\))?\s*\)", r"(forall \2: \1)"),
    _fix(r"<->|<=>|↔|⇔", "iff"),
    _fix(r"-{1,2}>|={1,2}>|→|⇒", "implies"),
    _fix(r"&&|&|∧", "and"),
    _fix(r"\|\||\||∨", "or"),
    _fix(r"!(?!=)\s*|¬", "not "),
    _fix(r"===", "=="),
    _fix(r"≤|=<", "<="),
    _fix(r"≥", ">="),
    _fix(r"≠|<>|!==", "!="),
    _fix(r"(?<![=<>!])=(?![=>])", "=="),
    _fix(r"\b(?:seconds?|secs?|sec)\b", "s"),
    _fix(r"\b(?:milliseconds?|msecs?)\b", "ms"),
    _fix(r"\b(?:minutes?|mins)\b", "min"),
    _fix(r"\b(?:hours?|hrs?)\b", "h"),
    _fix(r"\bmet(?:er|re)s?\b", "m"),
    _fix(r"\b(?:centimet(?:er|re)s?)\b", "cm"),
    _fix(r"\b(?:pixels?|pix|met(?:er|re)s?)\b", "px"),
    _fix(r"\b(?:degrees?|degs|°)\b", "deg"),
    _fix(rf"\b(once|always|eventually|henceforth|since|until|release)\s*\(\s*({_AMOUNT})\s*\)", r"\1[\2]"),
    _fix(rf"({_CALL})\s+(?:for\s+)?at\s+least\s+(\d[\d.]*\s*(?:ms|s|min|h))\b", r"\1 for \2"),
    _fix(r"\bout\s+of\b", "of"),
    _fix(r"(\d[\d.]*)\s*rad\b(/s)?", lambda m: f"{degrees(float(m[1])):.3g} deg{m[2] or ''}"),
    _fix(rf"\b(?:count|number|times)\(({_CALL})\)\s*[<>=]+\s*(\d+)", r"\1 in \2 of 10 samples"),
    _fix(r"\b(?:for|in|within)\s+(\d[\d.]*\s*%)\s+(?:of\s+)?(?:the\s+)?(?:last\s+|past\s+)?(?=\d)",
          r"in \1 of "),
    _fix(rf"\b(once|always|eventually|henceforth)\s+({_AMOUNT})\s+(?=\w)", r"\1[\2] "),
    _fix(r"(\b\w+\(\w+(?:\s*,\s*\w+)*)\s*(?=[<>=!]=?\s*[\d-])", r"\1) "),
    _fix(r"\b(?:kind|name|named|type|class|model)\((\w+)\)\s*(?:==?|\bis\b)\s*\"?([A-Za-z]\w*)\"?",
          r"named(\1, \2)"),
    _fix(r"(\b\w+\(\w+(?:\s*,\s*\w+)*)\s+(?=(?:and|or|implies|iff|for|within)\b)", r"\1) "),
    _fix(r"\b(px|ms|s|deg|%)\s+(\d[\d.]*)(?![\d.]*\s*(?:px|ms|s|deg)\b)", r"\2 \1"),
    _fix(r"^(?:def|function|fun|fn|alert|alarm|rules)\s+(?=\w+\()", "rule "),
    _fix(r"^(rule\s+\w+\((\w+)\s*,\s*(\w+)\):\s*\w+)(\s*)(?=say\b)", r"\1\4when touching(\2, \3)\4"),
    _fix(r"^(\w+\(\w+(?:\s*,\s*\w+)*\)\s*:)", r"rule \1"),
    _fix(r"^(rule\s[^:\n]*:)(\s*when\b)", r"\1 warning\2"),
    _fix(rf"({_CALL})\s*([<>]=?)\s*({_AMOUNT})\s*(and|or)\s+([<>]=?)\s*({_AMOUNT})",
          r"\1 \2 \3 \4 \1 \5 \6"),
    _fix(r"\b([A-Za-z_]\w*)\s*[\[{]\s*([a-z]\w*(?:\s*,\s*[a-z]\w*)*)\s*[\]}]", r"\1(\2)"),
    _fix(r"\b([a-z]\w?)\.([a-z_]{3,})\s*\(\s*([a-z]\w*)\s*\)", r"\2(\1, \3)"),
    _fix(r"\b([a-z]\w?)\.([a-z_]{3,})\b(?:\(\))?", r"\2(\1)"),
    _fix(r"\b(?:in|during|over)\s+(?:the\s+)?(?:last|past|previous)\s+(?=\d)", "within "),
    _fix(r",\s*,", ","),
    _fix(r"×", "*"),
    _fix(r"÷", "/"),
    _fix(rf"\b(rising|falling)\s+({_CALL})", r"\1(\2)"),
    _fix(rf"\bneither\s+({_CALL})\s+nor\s+", r"not \1 and not "),
    _fix(rf"\bafter\s+({_CALL})\s*,?\s*({_CALL})", r"\2 and once \1"),
    _fix(r"\b(when|and|or|not|unless)\s+since\b", r"\1 once"),
    _fix(r"\bduring\s+(?:the\s+last\s+)?(?=\d)", "for "),
    _fix(r"\b(for|within)\s+the\s+(?:last|past|next)\s+(?=\d)", r"\1 "),
    _fix(rf"\b(for|within)\s+({_AMOUNT})\s*(?:\.\.|-|to)\s*({_AMOUNT})(?!\s*ago)", r"\1 \2 to \3 ago"),
    _fix(r":\s*(?:high|severe|serious|major|urgent)\b(?=\s+when)", ": critical"),
    _fix(r":\s*(?:medium|moderate|minor|low|normal|caution)\b(?=\s+when)", ": warning"),
    _fix(rf"({_CALL})\s+not\s+((?:for|within)\s+{_AMOUNT})", r"not \1 \2"),
    _fix(r"\bwithout\b", "and not"),
    _fix(r"\b(?:is\s+)?(?:faster|farther|further|longer|wider|later|bigger)\s+than\b", ">"),
    _fix(r"\b(?:is\s+)?(?:slower|shorter|sooner|narrower|earlier)\s+than\b", "<"),
    _fix(rf"\b(to\s+{_AMOUNT})\s+(?:before|earlier|back|in\s+the\s+past)\b", r"\1 ago"),
    _fix(r"\bpercent\b", "%"),
    _fix(r"(?<=\d)\s*(?:km/h|kmh|mph|cm/s|mm/s|m/sec)\b", " px/s"),
    _fix(rf"({_CALL})\s*(?:===?|=|\bis)\s*[Tt]rue\b", r"\1"),
    _fix(rf"({_CALL})\s*(?:!==?|<>|\bis\s+not)\s*[Tt]rue\b", r"not \1"),
    _fix(rf"({_CALL})\s*(?:===?|=|\bis)\s*[Ff]alse\b", r"not \1"),
    _fix(rf"({_CALL})\s*(?:!==?|<>|\bis\s+not)\s*[Ff]alse\b", r"\1"),
    _fix(r"\b(north|south)[ ]+(east|west)_of\b", r"\1_\2_of"),
    _fix(rf"\bnever\s+({_CALL})", r"not \1"),
    _fix(rf"({_CALL})\s+never\b", r"not \1"),
    _fix(rf"({_CALL})\s+(?:for\s+)?(?:more|longer)\s+than\s+(\d[\d.]*\s*(?:ms|s|min|h))\b", r"\1 for \2"),
    _fix(r"\bat\s+the\s+same\s+time\s+as\b", "and"),
    _fix(rf"\b(eventually|henceforth)\s+({_CALL})\s*(\[[^\]\n]*\])", r"\1\3 \2"),
    _fix(r"\b(in\s+\d+)\s*/\s*(\d+\s+samples)\b", r"\1 of \2"),
    _fix(r"\b(exists|forall)\s+(\w+)\s+in\s+\w+\s*:", r"\1 \2:"),
    _fix(rf"\b(let\s+\w+\s+be\s[^:\n]*?\sat\s+{_CALL})\s+(?:and|or)\s+([^:\n]+)(?=\n|\Z)", r"\1: \2"),
    _fix(
        rf"\b(?:any|some|at\s+least)\s+([2-3])\s+of\s*\(({_CALL}(?:\s*,\s*{_CALL}){{1,3}})\)",
        lambda m: _some_of(int(m[1]), re.findall(_CALL, m[2])),
    ),
    _fix(
        r"\bthere\s+(?:is|are|exists?)\s+(?:an?\s+|some\s+|one\s+)?(\w+)\s*(?::|with|such that|so that)",
        r"exists \1:",
    ),
    _fix(rf"({_CALL})\s+in\s+\[?({_AMOUNT})\s*(?:\.\.|to|-)\s*({_AMOUNT})\]?",
          lambda m: _grouped(m, m.expand(r"\1 >= \2 and \1 <= \3"))),
    _fix(
        rf"\b(\d+)\s+(?:out\s+)?of\s+(?:the\s+last\s+)?(\d+)\s+(?:samples|frames)\s+({_CALL})",
        r"\3 in \1 of \2 samples",
    ),
    _fix(r"\bfor\s+(\d+)\s*(?:frames|samples)\b", r"in \1 of \1 samples"),
    _fix(r"\bwithin\s+(\d+)\s*(?:frames|samples)\b", r"in 1 of \1 samples"),
    _fix(rf"({_AMOUNT})\s*([<>]=?)\s*({_CALL})\s*([<>]=?)\s*({_AMOUNT})",
          lambda m: _grouped(m, m.expand(r"\1 \2 \3 and \3 \4 \5"))),
    _fix(r"\b(?:for|within)\s+(\d[\d.]*\s*(?:ms|s|min|h))\s+ago\b", r"within \1 to \1 ago"),
    _fix(r"\b(?:for|within)\s+-\s*(\d)", r"for \1"),
    _fix(rf"\b(for|within)\s+(\d[\d.]*\s*(?:ms|s|min|h))\s*,?\s+({_CALL})", r"\3 \1 \2"),
    _fix(
        r"\b([a-z])[ ]+(?:is[ ]+)?([a-z_]{3,})[ ]+(?:to[ ]+|with[ ]+)?([a-z])\b",
        lambda m: f"{closest(m[2], WORDS_OF_PAIRS) or m[2]}({m[1]}, {m[3]})",
    ),
    _fix(r"\b(?:under|below)\b", "<"),
    _fix(r"\b(?:over|above|exceeds)\b", ">"),
    _fix(r"(\d),(\d)", r"\1.\2"),
    _fix(r"\b(?:is\s+)?(?:less|smaller|lower|nearer|closer)\s+than\b|\bis\s+below\b", "<"),
    _fix(r"\b(?:is\s+)?(?:more|greater|larger|higher)\s+than\b|\bis\s+above\b", ">"),
    _fix(r"\b(?:is|equals)\b(?=\s*\d)", "=="),
    _fix(rf"(\[{_AMOUNT})\s*(?:to|,|:|-)\s*({_AMOUNT}\])", r"\1 .. \2"),
    _fix(rf"\bif\s+({_CALL})\s*,?\s*then\s+({_CALL})", r"\1 implies \2"),
    _fix(r"\b([a-z_]{3,})[ ]+([a-z])\b(?!\s*[:(,])", r"\1(\2)"),
    _fix(r"\b(in\s+\d+\s+of\s+\d+)\b(?! *\w)", r"\1 samples"),
    _fix(r"\b(?:historically|globally)\b", "always"),
    _fix(r"\b(?:previously|prev|last)\b(?!\s*\()", "previous"),
    _fix(r"\bnext\b", "eventually[0.1 s .. 0.1 s]"),
    _fix(r"\b(?:finally|F|future)(?=\s*\[)", "eventually"),
    _fix(r"\b(?:G|always|globally|henceforth)(?=\s*\[)", "henceforth"),
    _fix(r"\b(?:O|P|once)(?=\s*\[)", "once"),
    _fix(r"\b(?:H|historically)(?=\s*\[)", "always"),
    _fix(r"\b(?:exist|some|any)\b(?=\s+\w+\s*:)", "exists"),
    _fix(r"\b(?:all|each|every|for all)\b(?=\s+\w+\s*:)", "forall"),
    _fix(
        r"\b(exists|forall)\s+(\w+\((?:[^()]*,\s*)?(\w+)\))", lambda m: f"{m[1]} {m[3]}: {m[2]}"
    ),
    _fix(r"\b(exists|forall)\s+(\w+)\s+(?!may|:)", r"\1 \2: "),
    _fix(r"\blet\s+(\w+)\s+(?=\w+\()(?!be\b|as\b|is\b)", r"let \1 be "),
    _fix(r"\blet\s+(\w+)\s*(?::=|==?|\bas\b|\bis\b)\s*", r"let \1 be "),
    _fix(r"\b(let\s+\w+\s+be\s[^:\n]*?)\s+(?:when|if|once|on|upon|whenever)\b", r"\1 at"),
    _fix(rf"\b(let\s+\w+\s+be\s[^:\n]*?\sat\s+{_CALL})\s*(?:,|\bin\b|;|->)", r"\1:"),
    _fix(
        r"\b(?:freeze|remember|store|bind|define|set|with|where)\s+(\w+)\s*(?:=|:=|\bas\b|\bbe\b)\s*",
        r"let \1 be ",
    ),
    _fix(r"\b(let\s+\w+\s+be\s[^:\n]*?\))\s*:", r"\1 at true:"),
    _fix(r"\bbefore\b", "and previous"),
    _fix(r"\bduring\b|\bwhile\b", "and"),
    _fix(r"\bbut\b|\bthen\b", "and"),
    _fix(r"//", "#"),
    _fix(r"\b(?:if|whenever|condition)\b", "when"),
    _fix(r"\b(?:except|exept|excluding|exclude)\b", "unless"),
    _fix(r"\b(?:tell|print|message)\b", "say"),
    _fix(r"\b(?:error|fatal|alarm|emergency)\b", "critical"),
    _fix(r"\b(?:warn)\b", "warning"),
    _fix(r"\b(?:note|notice|debug)\b", "info"),
    _fix(r"'([^'\"\n]*)'", r'"\1"'),
    _fix(rf"\bsay[ \t]+(?!\"[^\"\n]*\"){_QUOTES}*([^\"\n]+?){_QUOTES}*[ \t]*$", r'say "\1"'),
    _fix(r"\bsay\s+([^\"\s][^\"\n]*)", lambda m: f'say "{m[1].strip()}"'),
    _fix(r"(say\s+\"[^\"\n]*\")(\s+)((?:hold|cooldown)\s+[\d.]+\s*\w+)", r"\3\2\1"),
    _fix(r"(say\s+\"[^\"\n]*\")(\s+)(when\s[^\n]*)", r"\3\2\1"),
    _fix(
        r"\brule\s+(\w+)\s+(\w+(?:[\s,]+\w+)*)\s*:",
        lambda m: f"rule {m[1]}({', '.join(_WORD.findall(m[2]))}):",
    ),
    _fix(r"\brule\s*\(", "rule name("),
    _fix(r"\brule\s+([A-Za-z]\w*)-(\w+)", r"rule \1_\2"),
    _fix(r"\bunless\b", "or"),
    _fix(r"\b(\w+)\s+(\w)\s*,?\s+(\w)\b(?!\s*[:(])", r"\1(\2, \3)"),
)  # fmt: skip
"""Tried in order; each only where it overlaps the error."""
