"""Deliberate mistakes of the eleventh sitting: `exists`, `between`, `on` and `on failure`, in both languages."""

# fmt: off
# ruff: noqa: E501
CONDITIONS = [
    "exists(c: touching(a, c)) and seen(b)",
    "exists c such that touching(a, c) and seen(b)",
    "exists c in objects: touching(a, c) and seen(b)",
    "exists c != a: touching(a, c) and seen(b)",
    "exists c, d: touching(c, d) and seen(a) and seen(b)",
    "exists (c) touching(a, c) and seen(b)",
    "there exists c: touching(a, c) and seen(b)",
    "exists c where touching(a, c) and seen(b)",
    "seen(a) and not exists c touching(a, c) and seen(b)",
    "gap(a, b) between 3 px and 5",
    "gap(a, b) is between 3 and 5 px",
    "gap(a, b) between (3 px, 5 px)",
    "gap(a, b) between 3 px .. 5 px",
    "between(gap(a, b), 3 px, 5 px)",
    "speed(a) not between 3 px/s and 5 px/s and seen(b)",
    "on(a, b)",
    "a on b",
    "on_top_of(a, b)",
    "not on(a, b) for 2 s",
]

WHOLE_RULES = [
    'rule watch(a): warning\n    when exists b touching(a, b)\n    say "{a} {b}"\n',
]

STAGES = [
    "on failure touching(x, y): <b>\n<a> ::= converging(x, y)",
    "on failure of touching(x, y): <b>\n<a> ::= touching(x, y)",
    "on failure touching(x, y)\n<a> ::= touching(x, y)",
    "on failure <a>: <b>\n<a> ::= touching(x, y)",
    "on failure of a: <b>\n<a> ::= touching(x, y)",
    "on failure: <b>\n<a> ::= touching(x, y)",
    "if <a> fails: <b>\n<a> ::= touching(x, y)",
    "<a> ::= touching(x, y) on failure <b>",
    "<a> ::= touching(x, y) on failure apart(x, y)",
    "on failure of <a>: apart(x, y), touching(x, y)\n<a> ::= touching(x, y)",
    "<a> ::= gap(x, y) between 20 px to 30 px",
    "<a> ::= between 20 px and 30 px gap(x, y)",
    "<a> ::= gap(x, y) between 20 and 30 px",
    "<a> ::= gap(x, y) within 20 px and 30 px",
    "<a> ::= exists(x)",
    "<a> ::= exists z: touching(x, z)",
    "<a> ::= touching(x, y) fails when exists z touching(x, z)",
    "<a> ::= on(x)",
    "<a> ::= x on y",
    "<a> ::= on_top(x, y)",
]

FILES: list[str] = []
