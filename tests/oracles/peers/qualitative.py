"""Relations of boxes and points as QSRlib's tests expect them, by `visup.rules.calculi`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import pairwise
from typing import Any

from visup.rules.calculi.allen import rectangle_relation
from visup.rules.calculi.positions import argd, cardinal, moving_or_stationary
from visup.rules.calculi.qtc import (
    Point,
    Signs,
    collapsed,
    continuous,
    qtc_bc_step,
    qtc_step,
)
from visup.rules.calculi.rcc import COARSER, Box, rcc

Case = Mapping[str, Any]
DIGITS = 9
"""Edges are computed from centres and sizes; so many decimals of them count."""
_SIGN = {-1: "-", 0: "0", 1: "+"}


def outcome_of(case: Case) -> str:
    """How a case comes out: `agree`, `differ` or `not_expressible`."""
    told = _teller(case["calculus"])
    if told is None:
        return "not_expressible"
    found = told(case)
    right = all(found.get((t, of)) == relation for t, of, relation in case["expected"])
    return "agree" if right else "differ"


def _teller(calculus: str) -> Callable[[Case], dict[tuple[int, str], str]] | None:
    if calculus in COARSER or calculus in _OF_PAIRS:
        return _pairs
    if calculus.startswith("QTC"):
        return _trajectories
    return _moved if calculus == "MOS" else None


_OF_PAIRS: Mapping[str, Callable[[Case, list[float], list[float]], str]] = {
    "cardinal directions": lambda case, a, b: cardinal(_point(a), _point(b)),
    "rectangle algebra": lambda case, a, b: ",".join(rectangle_relation(_box(a), _box(b))),
    "ARGD": lambda case, a, b: argd(
        _point(a), _point(b), case["parameters"]["qsr_relations_and_values"]
    ),
}


def _pairs(case: Case) -> dict[tuple[int, str], str]:
    found = {}
    for t, of, _ in case["expected"]:
        a, b = (_row(case, name, t) for name in of.split(","))
        if case["calculus"] in COARSER:
            grown = case["parameters"].get("quantisation_factor", 0.0)
            found[t, of] = rcc(_box(a), _box(b), case["calculus"], grown)
        else:
            found[t, of] = _OF_PAIRS[case["calculus"]](case, a, b)
    return found


def _moved(case: Case) -> dict[tuple[int, str], str]:
    slack = case["parameters"].get("quantisation_factor", 0.0)
    found = {}
    for t, name, _ in case["expected"]:
        before, now = _around(case, name, t)
        found[t, name] = moving_or_stationary(_point(before), _point(now), slack)
    return found


def _trajectories(case: Case) -> dict[tuple[int, str], str]:
    given = case["parameters"]
    found: dict[tuple[int, str], str] = {}
    for of in {of for _, of, _ in case["expected"]}:
        states = list(_states(case, *of.split(",")))
        if given["no_collapse"] and not given["validate"]:
            found |= {(t, of): _written(s) for t, s in states}
            continue
        row = [s for _, s in states]
        row = row if given["no_collapse"] else collapsed(row)
        row = continuous(row) if given["validate"] else row
        found |= {(n + 1, of): _written(s) for n, s in enumerate(row)}
    return found


def _states(case: Case, k: str, ell: str) -> Iterator[tuple[int, Signs]]:
    given = case["parameters"]
    slack, near = given["quantisation_factor"], given.get("distance_threshold")
    moments = [row[0] for row in case["objects"][k]]
    for then, now in pairwise(moments):
        one, other = (
            (_point(_row(case, name, then)), _point(_row(case, name, now))) for name in (k, ell)
        )
        if near is None:
            signs = qtc_step(one, other, slack)
            yield now, signs[:2] if case["calculus"] == "QTC-B" else signs
        else:
            yield now, qtc_bc_step(one, other, near, slack)


def _written(signs: Signs) -> str:
    return ",".join(_SIGN[s] for s in signs)


def _row(case: Case, name: str, t: int) -> list[float]:
    return next(row for row in case["objects"][name] if row[0] == t)


def _around(case: Case, name: str, t: int) -> tuple[list[float], list[float]]:
    rows = case["objects"][name]
    k = next(k for k, row in enumerate(rows) if row[0] == t)
    return rows[k - 1], rows[k]


def _point(row: list[float]) -> Point:
    return row[1], row[2]


def _box(row: list[float]) -> Box:
    _, x, y, w, h = (v or 0.0 for v in row)  # points have no size
    edges = (x - w / 2, y - h / 2, x + w / 2, y + h / 2)
    a, b, c, d = (round(e, DIGITS) for e in edges)
    return a, b, c, d
