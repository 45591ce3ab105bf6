"""Deliberate mistakes in whole rules."""

WHOLE_RULES = [
    'rul near(a, b): info\n    when touching(a, b)\n    say "{a}"',
    'rule near(a, b) info\n    when touching(a, b)\n    say "{a}"',
    'rule near(a, b): info\n    wen touching(a, b)\n    say "{a}"',
    'rule near(a, b): info\n    when touching(a, b)\n    cooldwn 3 s\n    say "{a}"',
    'rule near[a, b]: info\n    when touching(a, b)\n    say "{a}"',
    "rule near(a, b): info when touching(a, b) say {a}",
    'rule near a, b: info\n    when touching(a, b)\n    say "{a}"',
    'rule near(a, b): Warning\n    when touching(a, b)\n    say "{a}"',
    'rule near(a, b): info\n    when touching(a, b)\n    for 3 s\n    say "{a}',
    'rule near(a, b): info\n    when touching(a, b)\n    unless\n    say "{a}"',
    'rule near(a, b): info\n    when touching(a, b)\n    unles seen(a)\n    say "{a}"',
    'rule (a, b): info\n    when touching(a, b)\n    say "{a}"',
    'rule near(a, b): info\n    touching(a, b)\n    say "{a}"',
    'rule near(a, b): info\n    when touching(a, b)\n    sya "{a}"',
    'rule near(a, b): info,\n    when touching(a, b)\n    say "{a}"',
]
