"""Search patterns: a condition of the rule language, or several joined by `and then`.

`f and then g within 5 s` is true when g is, and f was at an earlier sample, at most 5 s before; without
`within`, at any earlier sample.

>>> desugared("touching(a, b) and then diverging(a, b) within 5 s")
'(diverging(a, b)) and ((touching(a, b)) within 1 ms to 5 s ago)'
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from visup.agent.model.errors import RuleError
from visup.rules.safety.expression import Expression, expression

_THEN = re.compile(r"\band\s+then\b")
_WITHIN = re.compile(r"^(?P<what>.*)\bwithin\s+(?P<span>\d+(\.\d+)?\s*(ms|s|min|h))\s*$", re.DOTALL)
JUST_BEFORE = "1 ms"
"""A sample holds until the next one, so what held this shortly ago held at the previous sample."""


def read_pattern(text: str) -> Expression:
    """Parse and compile a condition.

    Raises:
        RuleError: It is not a valid condition.
        ErrorGroup: It has several mistakes.
    """
    if len(parts := list(_parts(text))) > 1:
        for part in parts:  # mistakes are reported at their own position
            expression(_stripped(_WITHIN.sub(r"\g<what>", part)))
    found = expression(desugared(text))
    if found.quantity:
        raise RuleError(
            f"'{text}' is a quantity, which is neither true nor false",
            expected=f"a condition, such as: {text} < 20 px",
        )
    return found


def desugared(text: str) -> str:
    """The text with every `and then` expanded to the rule language.

    Raises:
        RuleError: Something is missing before or after one.
    """
    first, *following = _parts(text)
    if not following:
        return text
    condition = _stripped(first)
    for part in following:
        match = _WITHIN.match(part)
        before = (
            f"({condition}) within {JUST_BEFORE} to {match['span']} ago"
            if match
            else (f"previous once ({condition})")
        )
        condition = f"({_stripped(match['what'] if match else part)}) and ({before})"
    return condition


def _stripped(part: str) -> str:
    if not part.strip():
        raise RuleError(
            "something is missing beside `and then`", expected="f and then g within 5 s"
        )
    return part.strip()


def _parts(text: str) -> Iterator[str]:
    """The parts between the `and then` that are outside parentheses."""
    begin = 0
    for match in _THEN.finditer(text):
        before = text[: match.start()]
        if before.count("(") == before.count(")"):
            yield text[begin : match.start()]
            begin = match.end()
    yield text[begin:]
