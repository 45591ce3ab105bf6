"""Deliberate mistakes of the twelfth sitting: other forms of those of the eleventh."""

# fmt: off
CONDITIONS = [
    "exists c | touching(a, c) and seen(b)",
    "exists some c: touching(a, c) and seen(b)",
    "exists object c: touching(a, c) and seen(b)",
    "∃ c: touching(a, c) and seen(b)",
    "any c: touching(a, c) and seen(b)",
    "for some c: touching(a, c) and seen(b)",
    "exists c: touching(a, c) exists d: touching(b, d)",
    "exists c: and touching(a, c) and seen(b)",
    "exists: touching(a, b)",
    "exists 2 c: touching(a, c) and seen(b)",
    "gap(a, b) in between 3 px and 5 px",
    "gap(a, b) between 3 px, 5 px",
    "gap(a, b) between 3 px - 5 px",
    "gap(a, b) between [3 px, 5 px]",
    "gap(a, b) from 3 px to 5 px",
    "between(a, b) < 5 px",
    "a is on b",
    "on(a) and seen(b)",
    "on(a, b) or above(a, b)",
    "on top of(a, b)",
]

WHOLE_RULES: list[str] = []

STAGES = [
    "on failure of touching(x, y) do <b>\n<a> ::= touching(x, y)",
    "on failure touching(x, y) -> <b>\n<a> ::= touching(x, y)",
    "on failure of <touching>: <b>\n<a> ::= touching(x, y)",
    "on failure of <a>, <b>: <b>\n<a> ::= touching(x, y)",
    "on failure of <a> <b>\n<a> ::= touching(x, y)",
    "on failure of stage a: <b>\n<a> ::= touching(x, y)",
    "on_failure of <a>: <b>\n<a> ::= touching(x, y)",
    "when <a> fails: <b>\n<a> ::= touching(x, y)",
    "on error of <a>: <b>\n<a> ::= touching(x, y)",
    "on failure of <a>: <a> 2 times\n<a> ::= touching(x, y)",
    "<a> ::= touching(x, y) on failure of touching(x, y)",
    "<a> ::= gap(x, y) is between 20 px and 30 px",
    "<a> ::= gap(x, y) between 20 px and 30 px and 40 px",
    "<a> ::= gap between x and y < 20 px",
    "<a> ::= touching(x, y) fails when gap(x, z) between 3 and 5 px",
    "<a> ::= there exists x",
    "<a> ::= exist(x, y)",
    "<a> ::= x is on y",
    "<a> ::= ontop(x, y)",
    "<a> ::= on x y",
]

FILES: list[str] = []
