"""Deliberate mistakes of the fourteenth sitting, over parts of both grammars that are seldom used."""

# fmt: off
# ruff: noqa: E501
CONDITIONS = [
    "let x = speed(a) when touching(a, b): speed(a) > x",
    "let x be speed(a) at touching(a, b), speed(a) > x",
    "let x be gap(a, b) at rising(seen(a)): gap(a, b) > y",
    "forall c: not touching(a, c) and seen(c) or seen(b)",
    "exists c, d: touching(c, d) and touching(a, b)",
    "touching(a, b) since 5 s seen(a)",
    "touching(a, b) in 3 of the last 5 samples",
    "touching(a, b) in 3 from 5 samples",
    "touching(a, b) in 60 of 2 s",
    "speed(a) > 5 px/s leave and touching(a, b)",
    "rate(gap(a, b)) > 3 px/s",
    "max(speed(a), speed(b) > 40 px/s",
    "expected(a, b) or touching(a, b)",
    "inside(a, bay) and inside(b bay)",
    "last(touching(a, b), 0,5 s) and seen(b)",
    "previous(touching(a, b) and seen(b)",
    "eventually[2 s .. 5] touching(a, b)",
]

WHOLE_RULES = [
    'rule r(a, b may repeat) info\n    when touching(a, b)\n    say "{a} {b}"\n',
    'rule r(a, b): info\n    when touching(a, b)\n    unless\n    say "{a} {b}"\n',
    'rule r(a, b): info\n    touching(a, b)\n    say "{a} {b}"\n',
]

STAGES = [
    "<a> ::= any 2 (touching(x, y), coupled(x, z), converging(y, z))",
    "<a> ::= touching(x, y) at least twice",
    "<a> ::= touching(x, y) after 10 to 60 s",
    "<a> ::= gap(x, y) between 20 and 100 px",
    "<a> ::= touching(x, y) every 2 to 4 s",
    "<a> ::= touching(gripper of arm of robot, y)",
    "<a> ::= touching(x, y) pauses while seen(z)",
    "<a> ::= touching(x, y) ends touching(x, z)",
    "<a> ::= already <touching>",
    "<a> ::= touching(x, y) & & coupled(x, z)",
]

FILES = [
    "<t> ::= for each leg in leg_1, leg_2 <mount(leg)>\n<mount(leg)> ::= touching(leg, top) coupled(leg, top)\n",
    "<t> ::= for each 4 legs <mount(leg)>\n<mount(leg)> ::= touching(leg, top) coupled(leg, top)\n",
    "<t> ::= touching(x, y)\nactor x is leftmost cup\n",
    "<t> ::= touching(x, y)\nactor x is what enter from left\n",
    "<t> ::= inside(x, berth)\nzone berth is (100, 50), (300, 50), (300, 200)\n",
    "<t> ::= touching(x, y) within patience\nparameter patience = 90\n",
    "<t> ::= <a> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\nnever touching(x, z) during <a>, <b>\n",
    "<t> ::= <a> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\non failure of <nosuch>: apart(x, y) <b>\n",
]
