"""Whether what a behaviour reports makes sense: nonsense stops here and never enters the mind.

Each check raises a `BehaviourError` that says what is wrong and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.contract.contract import Contract
from visup.agent.model.errors import BehaviourError
from visup.agent.model.records import (
    CameraMotion,
    Depth,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
)

SAME_TIME_S = 1e-6
DEEPEST = 8
"""Values of plug-ins' own kinds may nest this deep."""


def collect_percepts(contract: Contract, said: object) -> tuple[Percept, ...]:
    """What a behaviour returned, as percepts; a generator that does not end is cut off.

    Raises:
        BehaviourError: It is not iterable, holds something else, or is more than the contract allows.
    """
    if not isinstance(said, Iterable) or isinstance(said, str | bytes | Mapping | Percept):
        raise BehaviourError(
            f"behaviour '{contract.name}' returned {_a(said)}",
            expected="percepts, one after another: yield each, or return a list of them",
            hint="return () when there is nothing to report" if said is None else None,
        )
    percepts = tuple(islice(said, contract.most_percepts + 1))
    for percept in percepts:
        if not isinstance(percept, Percept):
            raise BehaviourError(
                f"behaviour '{contract.name}' reported {_a(percept)}", expected="a Percept"
            )
    if len(percepts) > contract.most_percepts:
        raise BehaviourError(
            f"behaviour '{contract.name}' reported more than {contract.most_percepts} percepts",
            expected="at most `most_percepts` of its contract in one run",
        )
    return percepts


def check_percepts(
    contract: Contract, percepts: Iterable[Percept], frame: Frame, before: Observation | None = None
) -> None:
    """Refuse percepts that are not as the contract and their kinds want them.

    Args:
        contract: Of the behaviour.
        percepts: What it reported.
        frame: The frame that they are about.
        before: What others reported of it: no two may give a region one id.

    Raises:
        BehaviourError: One is nonsense.
    """
    region_ids: set[int] = {r.id for r in before.of("region")} if before is not None else set()
    for p in percepts:
        who = f"behaviour '{contract.name}' reported '{_brief(p.kind)}'"
        if not isinstance(p.kind, str) or p.kind not in contract.gives:
            expected = f"one of its contract's kinds: {', '.join(contract.gives)}"
            raise BehaviourError(who, expected=expected)
        _expect(
            _finite(p.time) and abs(p.time - frame.time) <= SAME_TIME_S,
            f"{who} with time {_brief(p.time)}",
            f"the frame's time, {frame.time:g} s",
        )
        _expect(
            p.source == contract.name,
            f"{who} with source {_brief(p.source)}",
            f"its own name, '{contract.name}'",
        )
        _expect(
            _finite(p.confidence) and 0.0 <= p.confidence <= 1.0,
            f"{who} with confidence {_brief(p.confidence)}",
            "a number from 0 to 1",
        )
        kind = VALUE_CHECKS.get(p.kind)
        if kind is None:
            _own(p.value, who)
            continue
        kind_type, judge = kind
        _expect(isinstance(p.value, kind_type), f"{who} as {_a(p.value)}", _a_type(kind_type))
        judge(p.value, frame.size)
        if isinstance(p.value, Region):
            _expect(
                p.value.id not in region_ids,
                f"region {p.value.id} comes twice",
                "each id once, also among all behaviours that give regions",
            )
            region_ids.add(p.value.id)


def _region(r: Region, size: tuple[int, int]) -> None:
    who = f"region {_brief(r.id)}"
    _expect(isinstance(r.id, int) and r.id >= 1, f"{who} has no number", "an id from 1")
    _expect(
        isinstance(r.bbox, tuple) and len(r.bbox) == 4 and all(_integer(v) for v in r.bbox),
        f"{who} has box {_brief(r.bbox)}",
        "(x, y, width, height) in whole pixels",
    )
    x, y, w, h = r.bbox
    inside = x >= 0 and y >= 0 and w > 0 and h > 0 and x + w <= size[0] and y + h <= size[1]
    shape = getattr(r.mask, "shape", None)
    _expect(
        inside and shape == (h, w),
        f"{who} has box {r.bbox} and a mask of {_brief(shape)}",
        f"a box within {size} and a mask of (height, width) of the box",
    )
    _expect(r.mask.dtype == np.bool_, f"{who} has a mask of {r.mask.dtype}", "a mask of bool")
    _expect(bool(r.mask.any()), f"{who} has an empty mask", "at least one pixel")
    _array(r.contour, f"{who}: contour", (None, 2))
    if r.motion is not None:
        _array(r.motion, f"{who}: motion", (2, 3))
    for name, value in (("centroid", r.centroid), ("velocity", r.velocity)):
        pair = isinstance(value, tuple) and len(value) == 2 and all(_finite(v) for v in value)
        _expect(pair, f"{who} has {name} {_brief(value)}", "(x, y), two finite numbers")
    for name, number in (("area", r.area), ("velocity_sigma", r.velocity_sigma)):
        _expect(_least(number, 0.0), f"{who} has {name} {_brief(number)}", "a number, at least 0")
    _expect(_share(r.confidence), f"{who} has confidence {_brief(r.confidence)}", "0 to 1")


def _hypothesis(h: Hypothesis, size: tuple[int, int]) -> None:
    who = f"hypothesis of region {_brief(h.region_id)}"
    _expect(_integer(h.region_id), f"{who} has no region", "the id of a region of this frame")
    _expect(isinstance(h.name, str) and bool(h.name), f"{who} has no name", "the name of a model")
    _expect(_integer(h.view), f"{who} has view {_brief(h.view)}", "the number of a view")
    _expect(_share(h.similarity), f"{who} has similarity {_brief(h.similarity)}", "0 to 1")
    for name, value in (("rotation", h.rotation), ("scale", h.scale)):
        fine = value is None or _finite(value)
        _expect(fine, f"{who} has {name} {_brief(value)}", "a finite number, or None")
    if h.direction is not None:
        _array(h.direction, f"{who}: direction", (3,))


def _depth(d: Depth, size: tuple[int, int]) -> None:
    who = f"depth of region {_brief(d.region_id)}"
    _expect(_integer(d.region_id), f"{who} has no region", "the id of a region of this frame")
    _expect(isinstance(d.name, str), f"{who} has name {_brief(d.name)}", "the name of a model")
    positive = _finite(d.depth) and d.depth > 0
    _expect(positive, f"{who} is {_brief(d.depth)}", "a finite number above 0")
    _expect(_least(d.sigma, 0.0), f"{who} has sigma {_brief(d.sigma)}", "a number, at least 0")


def _camera(c: CameraMotion, size: tuple[int, int]) -> None:
    _array(c.motion, "camera: motion", (2, 3))
    turn = float(np.linalg.det(c.motion[:, :2]))
    _expect(
        turn > 0.0, f"camera: motion with determinant {turn:.3g}", "one above 0: it can be undone"
    )


def _health(h: Health, size: tuple[int, int]) -> None:
    fine = isinstance(h.status, HealthStatus) and isinstance(h.detail, str)
    _expect(fine, f"health has status {_brief(h.status)}", "a HealthStatus and a sentence")


VALUE_CHECKS: Mapping[str, tuple[type, Callable[[Any, tuple[int, int]], None]]] = {
    "region": (Region, _region),
    "hypothesis": (Hypothesis, _hypothesis),
    "depth": (Depth, _depth),
    "camera": (CameraMotion, _camera),
    "health": (Health, _health),
}
"""Kinds with a fixed type of value, and what judges one of them."""


def _own(value: object, who: str, depth: int = 0) -> None:
    """A value of a plug-in's own kind: data, in which all numbers are finite; what is missing is None."""
    _expect(depth <= DEEPEST, f"{who} nested too deep", f"at most {DEEPEST} levels")
    if value is None or isinstance(value, str | bytes | int | Enum | np.integer | np.bool_):
        return
    if isinstance(value, float | np.floating):
        _expect(bool(np.isfinite(value)), f"{who} as {value}", "a finite number, or None")
    elif isinstance(value, np.ndarray):
        _own_array(value, who)
    else:
        for part in _parts(value, who):
            _own(part, who, depth + 1)


def _parts(value: object, who: str) -> Iterable[object]:
    if isinstance(value, Mapping):
        return (*value.keys(), *value.values())
    if isinstance(value, tuple | list | set | frozenset):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return [getattr(value, f.name) for f in fields(value)]
    raise BehaviourError(
        f"{who} with {_a(value)} in it",
        expected="numbers, text, arrays, and lists, dicts or dataclasses of these",
    )


def _own_array(value: NDArray[Any], who: str) -> None:
    _expect(value.dtype.kind in "biufSU", f"{who} as an array of {value.dtype}", "numbers or text")
    if value.dtype.kind == "f":
        # A masked array says where nothing was measured.
        known = value.compressed() if isinstance(value, np.ma.MaskedArray) else value
        _expect(
            bool(np.isfinite(known).all()),
            f"{who} with numbers that are not finite",
            "finite numbers; mask what was not measured with numpy.ma",
        )


def _array(value: Any, who: str, shape: tuple[int | None, ...]) -> None:
    try:
        found = np.asarray(value)
    except ValueError:
        found = np.empty((), dtype=object)  # rows of unlike lengths
    like = len(found.shape) == len(shape) and all(
        wanted in (None, given) for wanted, given in zip(shape, found.shape, strict=True)
    )
    said = ", ".join("N" if n is None else str(n) for n in shape)
    _expect(like, f"{who} has shape {found.shape}", f"({said})")
    numbers = found.dtype.kind in "iuf" and bool(np.isfinite(found).all())
    _expect(numbers, f"{who} contains a number that is not finite", "finite numbers")


def _expect(fine: bool, what: str, expected: str) -> None:
    if not fine:
        raise BehaviourError(what, expected=expected)


def _finite(value: object) -> bool:
    plain = isinstance(value, int | float | np.integer | np.floating)
    return plain and not isinstance(value, bool) and math.isfinite(value)  # type: ignore[arg-type]


def _least(value: object, least: float) -> bool:
    return _finite(value) and value >= least  # type: ignore[operator]


def _share(value: object) -> bool:
    return _finite(value) and 0.0 <= value <= 1.0  # type: ignore[operator]


def _integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _a(value: object) -> str:
    return "nothing (None)" if value is None else _a_type(type(value))


def _a_type(kind: type) -> str:
    return f"{'an' if kind.__name__[:1].lower() in 'aeiou' else 'a'} {kind.__name__}"


def _brief(value: object) -> str:
    """A value for a message: whatever it is, short and on one line."""
    text = value if isinstance(value, str) else repr(value)
    return " ".join(text.split())[:60]
