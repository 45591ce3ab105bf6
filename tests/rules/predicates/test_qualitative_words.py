"""Allen's relations and TPCC as words of rules are those of the calculi, and they compose."""

from __future__ import annotations

from cmath import exp, pi
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from visup.agent import Mind, ObjectBelief, Observation, Presence
from visup.agent.model.errors import VisupError
from visup.rules.calculi.allen import NAMES, allen
from visup.rules.calculi.composition import allen_composition
from visup.rules.calculi.positions import tpcc
from visup.rules.formula.truth import MAYBE, YES
from visup.rules.language.parser import parse_rules
from visup.rules.predicates.qualitative_words import (
    _SIGNS,
    ALLEN_RELATIONS,
    STRAIGHT_DEG,
    TPCC_RELATIONS,
)
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import PREDICATES
from visup.rules.safety.reasoner import RuleReasoner
from visup.testing import region_of

SIZE = (640, 480)
GRID = 20  # pixels, much more than what counts as level
SIGNS = {name: sign for sign, name in NAMES.items()}
spans = st.tuples(st.integers(0, 8), st.integers(1, 8)).map(lambda t: (t[0], t[0] + t[1]))
boxes = st.tuples(spans, spans)


def mind_of(*rectangles: tuple[int, int, int, int]) -> Mind:
    """A mind in which these boxes (x, y, width, height) are seen."""
    regions = [
        region_of(np.ones((h, w), bool), n, at=(x, y), size=SIZE)
        for n, (x, y, w, h) in enumerate(rectangles, start=1)
    ]
    beliefs = [ObjectBelief(r.id, r, Presence.SEEN, 0.0, 1.0, confirmed=True) for r in regions]
    return Mind(time=1.0, frame_size=SIZE).with_objects(*beliefs)


def mind(*drawn: tuple[tuple[int, int], tuple[int, int]]) -> Mind:
    return mind_of(
        *(
            (x0 * GRID, y0 * GRID, (x1 - x0) * GRID, (y1 - y0) * GRID)
            for (x0, x1), (y0, y1) in drawn
        )
    )


def relations_that_hold(facts: Snapshot, word: str, a: int, b: int) -> list[str]:
    return [r for r in ALLEN_RELATIONS if PREDICATES[word].evaluate(facts, r)[a, b] == YES]


@settings(max_examples=60, deadline=None)
@given(boxes, boxes, boxes)
def test_exactly_one_allen_relation_holds_along_each_axis_and_they_compose(
    a: tuple[tuple[int, int], tuple[int, int]],
    b: tuple[tuple[int, int], tuple[int, int]],
    c: tuple[tuple[int, int], tuple[int, int]],
) -> None:
    drawn, facts = (a, b, c), Snapshot(mind(a, b, c))
    table = allen_composition()
    for axis, word in enumerate(("along_x", "along_y")):
        found = {}
        for i, j in permutations(range(3), 2):
            (name,) = relations_that_hold(facts, word, i, j)
            assert SIGNS[name] == allen(drawn[i][axis], drawn[j][axis])
            found[i, j] = SIGNS[name]
        for i, j, k in permutations(range(3), 3):
            assert found[i, k] in table[found[i, j], found[j, k]]


places = st.tuples(st.integers(1, 28), st.integers(1, 20))


@settings(max_examples=100, deadline=None)
@given(places, places, places)
def test_tpcc_equals_its_definition_except_near_straight_lines(
    a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]
) -> None:
    assume(len({a, b, c}) == 3)
    points = [(x * GRID + 5.0, y * GRID + 5.0) for x, y in (a, b, c)]
    facts = Snapshot(mind_of(*((int(x) - 5, int(y) - 5, 11, 11) for x, y in points)))
    look = PREDICATES["tpcc"].evaluate
    found = [r for r in TPCC_RELATIONS if look(facts, r)[0, 1, 2] == YES]
    assert len(found) == 1
    up = [(x, -y) for x, y in points]
    exact = tpcc(*up)
    near = {
        tpcc(up[0], up[1], rotated_about(up[1], up[2], s * STRAIGHT_DEG)) for s in (-1.01, 0, 1.01)
    } | {exact}
    assert found[0] in near or found[0][1:].startswith("s")
    if all(not r[1:].startswith("s") for r in near) and len(near) == 1:
        assert found[0] == exact


def rotated_about(
    about: tuple[float, float], point: tuple[float, float], degrees: float
) -> tuple[float, float]:
    moved = complex(point[0] - about[0], point[1] - about[1]) * exp(1j * pi * degrees / 180)
    return about[0] + moved.real, about[1] + moved.imag


def test_relations_of_hidden_objects_are_unknown() -> None:
    seen = mind_of((0, 0, 20, 20), (50, 50, 20, 20), (100, 0, 20, 20))
    facts = Snapshot(seen.with_objects(replace(seen.objects[2], presence=Presence.HIDDEN)))
    assert PREDICATES["along_x"].evaluate(facts, "before")[0, 1] == MAYBE
    assert PREDICATES["along_x"].evaluate(facts, "before")[0, 2] == YES
    assert PREDICATES["tpcc"].evaluate(facts, "csf")[0, 1, 2] == MAYBE


def test_rules_name_qualitative_relations() -> None:
    (rule,) = parse_rules(
        "rule r(a, b, c): info\n when along_x(before, a, b) and tpcc(dsf, a, b, c)\n"
        ' say "{a} {b} {c}"'
    )
    reason = RuleReasoner((rule,))
    row = mind_of((0, 100, 20, 20), (60, 100, 20, 20), (200, 100, 20, 20))
    conditions = reason(row, Observation(0, 1.0, SIZE)).conditions
    assert {c.objects for c in conditions} == {(1, 2, 3)}
    for text, said in (("along_x(befor, a, b)", "before"), ("tpcc(zzz, a, b, c)", "one of")):
        with pytest.raises(VisupError, match=said):
            parse_rules(
                f'rule r(a, b, c): info\n when {text} and seen(c)\n say "{{a}} {{b}} {{c}}"'
            )


def test_every_allen_relation_has_distinct_signs() -> None:
    assert set(_SIGNS) == set(ALLEN_RELATIONS)
    assert len(set(_SIGNS.values())) == 13
    assert len(TPCC_RELATIONS) == len(set(TPCC_RELATIONS)) == 25
