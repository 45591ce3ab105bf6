"""Calculi by their definitions: exactly one relation, converses, composition, and what they see in common."""

from itertools import pairwise, product

from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.relation_oracles import rcc8_by_definition
from visup.rules.calculi.allen import ALLEN, allen, rectangle_relation
from visup.rules.calculi.composition import (
    allen_composition,
    rcc8_composition,
    rcc_composition,
)
from visup.rules.calculi.positions import CARDINAL, argd, cardinal, moving_or_stationary, tpcc
from visup.rules.calculi.qtc import collapsed, continuous, qtc_bc_step, qtc_step
from visup.rules.calculi.rcc import COARSER, RCC8, Box, rcc

SHORT = dict(
    zip(
        (
            "disconnected",
            "externally_connected",
            "partially_overlapping",
            "equal",
            "tangential_proper_part",
            "non_tangential_proper_part",
            "tangential_proper_part_inverse",
            "non_tangential_proper_part_inverse",
        ),
        RCC8,
        strict=True,
    )
)
small = st.integers(0, 6)
boxes = st.builds(lambda x, y, w, h: (x, y, x + w + 1, y + h + 1), small, small, small, small)
points = st.tuples(st.integers(-5, 5), st.integers(-5, 5))
CONVERSE = {
    "tpp": "tppi",
    "ntpp": "ntppi",
    "tppi": "tpp",
    "ntppi": "ntpp",
    "pp": "ppi",
    "ppi": "pp",
}


@given(boxes, boxes)
def test_rcc8_is_its_definition_point_by_point(a: Box, b: Box) -> None:
    one, two = ((int(p[0]), int(p[1]), int(p[2] - p[0]), int(p[3] - p[1])) for p in (a, b))
    assert rcc(a, b) == SHORT[rcc8_by_definition(one, two)]


@given(boxes, boxes, boxes)
def test_every_triple_of_boxes_keeps_the_composition_tables(a: Box, b: Box, c: Box) -> None:
    for calculus in COARSER:
        ab, bc, ac = (rcc(p, q, calculus) for p, q in ((a, b), (b, c), (a, c)))
        assert ac in rcc_composition(calculus)[ab, bc]
    across = zip(*(rectangle_relation(p, q) for p, q in ((a, b), (b, c), (a, c))), strict=True)
    for ab, bc, ac in across:
        assert ac in allen_composition()[ab, bc]


@given(boxes, boxes)
def test_converses(a: Box, b: Box) -> None:
    there, back = rcc(a, b), rcc(b, a)
    assert back == CONVERSE.get(there, there)
    inverse = {"=": "=", "<": ">", ">": "<"}
    for one, other in zip(rectangle_relation(a, b), rectangle_relation(b, a), strict=True):
        assert other == inverse.get(one, one.removesuffix("i") if one.endswith("i") else one + "i")


def test_the_tables_are_those_that_are_published() -> None:
    assert set(rcc8_composition()) == set(product(RCC8, repeat=2))
    # Allen 1983: 169 cells, of which 27 hold one relation only where neither side is `=`, and so on.
    table = allen_composition()
    assert set(table) == set(product(ALLEN, repeat=2))
    assert sum(len(cell) for cell in table.values()) == 409
    assert all(table["=", r] == {r} == table[r, "="] for r in ALLEN)


def test_grown_boxes_meet_and_overlap_partially() -> None:
    a, b = (0.0, 0.0, 2.0, 2.0), (3.0, 0.0, 5.0, 2.0)
    assert [rcc(a, b, grown=g) for g in (0.0, 0.5, 2.0)] == ["dc", "ec", "po"]


@given(points, points, points, points)
def test_qtc_is_turned_with_its_points_and_mirrored_with_the_plane(
    k0: tuple[int, int], k1: tuple[int, int], l0: tuple[int, int], l1: tuple[int, int]
) -> None:
    signs = qtc_step((k0, k1), (l0, l1))
    assert qtc_step((l0, l1), (k0, k1)) == (signs[1], signs[0], signs[3], signs[2])

    def mirror(p: tuple[int, int]) -> tuple[int, int]:
        return -p[0], p[1]

    other = qtc_step((mirror(k0), mirror(k1)), (mirror(l0), mirror(l1)))
    assert other == (signs[0], signs[1], -signs[2], -signs[3])
    near = qtc_bc_step((k0, k1), (l0, l1), near=3.0)
    assert near == signs[: len(near)]
    assert len(near) == (4 if (k1[0] - l1[0]) ** 2 + (k1[1] - l1[1]) ** 2 <= 9 else 2)


@given(st.lists(st.tuples(*[st.integers(-1, 1)] * 4), min_size=1, max_size=8))
def test_states_become_continuous_and_lose_nothing(states: list[tuple[int, ...]]) -> None:
    found = continuous(collapsed(states))
    for before, after in pairwise(found):
        assert all(p * s >= 0 for p, s in zip(before, after, strict=True))
    rest = iter(found)
    assert all(any(state == other for other in rest) for state in collapsed(states))


@given(points, points, points)
def test_positions(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> None:
    seen, back = cardinal(a, b), cardinal(b, a)
    assert (seen == "eq") == (a == b)
    if a != b:
        assert CARDINAL[(CARDINAL.index(seen) + 4) % 8] == back
    assert argd(a, b, {"near": 2, "far": 5}) == argd(b, a, {"far": 5, "near": 2})
    assert (moving_or_stationary(a, b) == "m") == (a != b)
    turned = tpcc((-a[1], a[0]), (-b[1], b[0]), (-c[1], c[0]))
    assert tpcc(a, b, c) == turned


def test_three_points() -> None:
    origin, relatum = (0, 0), (0, 2)
    expected = {(0, 2): "sam", (0, 3): "csf", (0, 5): "dsf", (0, 1): "csb", (-1, 2): "csl", (3, 2): "dsr",
                (-2, 3): "dlf", (1, 4): "dfr"}  # fmt: skip
    assert {p: tpcc(origin, relatum, p) for p in expected} == expected
    assert tpcc(origin, origin, origin) == "tri"
    assert tpcc(origin, origin, relatum) == "dou"


def test_one_relation_for_each_pair_of_intervals() -> None:
    assert allen((0, 1), (2, 3)) == "<"
    assert len({allen((p, q), (2, 5)) for p, q in product(range(8), repeat=2) if p < q}) == 13
