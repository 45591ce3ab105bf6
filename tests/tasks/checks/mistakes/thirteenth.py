"""Deliberate mistakes of the thirteenth sitting, as users of several trades may make them."""

# fmt: off
CONDITIONS = [
    "speed(a) > 20 px/s for 2",
    "speed(a) > 20 for 2 s",
    "toching(a, b) for 1 s or coupled(a, b)",
    "touching(a, b) for 1 s and gap(a, c) < 5 px",
    "touching(a) for 2 s",
    "seen(a, b) and touching(a, b)",
    "gap(a, b) < 20 px/s",
    "(gap(a, b) < 20 px and seen(a)",
    "gap(a, b) < 20 px and and seen(a)",
    "touching(a, b) seen(b)",
    "touching(a b)",
    "G[0,5] (gap(a, b) > 3 px)",
    "eventually[0:5] touching(a, b)",
    "once[5] touching(a, b)",
    "touching(a, b) within 3 sec",
    "Touching(a, b) and Seen(a)",
    "touching(A, B)",
    "gap(a, b) =< 20 px",
    "20 px < gap(a, b) < 40 px",
    "inside(a) and seen(b)",
]

WHOLE_RULES = [
    'rule r(a, b) warning\n    when touching(a, b)\n    say "{a} {b}"\n',
    'rule r(a, b): error\n    when touching(a, b)\n    say "{a} {b}"\n',
    'rule r(a, b): info\n    when touching(a, b)\n    unless seen(a)\n    say "{a} {c}"\n',
    'rule r(a, b): info\n    when touching(a, b)\n    hold 3\n    say "{a} {b}"\n',
    'rules r(a, b): info\n    when touching(a, b)\n    say "{a} {b}"\n',
    "rule r(a, b): info\n    when touching(a, b)\n    say {a} touches {b}\n",
]

STAGES = [
    "<a> ::= touching(x, y) for 2",
    "<a> ::= touching(x y) within 30 s",
    "<a> ::= touchng(x, y) within 30 s",
    "<a> ::= touching(x) within 30 s",
    "<a> ::= touching(x, y, b)",
    "<a> :== touching(x, y)",
    "<a> ::= gap(x, y) < 20",
    "<a> ::= touching(x, y) fails if gap(x, y) > 20 px",
    "<a> ::= touching(x, y) fails when gap(x, y) > 20 px or",
    "<a> ::= (touching(x, y) | converging(x, y)",
]

FILES = [
    "<t> ::= <grasp> <lifts>\n<grasp> ::= coupled(hand, cup)\n<lift> ::= diverging(cup, table)\n",
    "<t> ::= <a> then <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\n",
    "<t> ::= <a> -> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\n",
    "<t> ::= any order <a>, <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, z)\n",
]
