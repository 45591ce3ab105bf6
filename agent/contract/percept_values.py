"""Checks the values of percepts, of visup's kinds and of plug-ins' own.

Applied to the reports of behaviours (`validation.py`) and to those read from a journal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import BehaviourError
from visup.agent.model.records import CameraMotion, Depth, Health, HealthStatus, Hypothesis, Region

DEEPEST = 8
"""Values of plug-ins' own kinds may nest this deep."""
MAX_BITS = 1024
"""Longest integer, bits: longer ones could not be written and read back as JSON."""
LARGEST_SIDE = 2**16
"""Largest width or height of a frame, pixels."""


def check_value(kind: str, value: Any, size: tuple[int, int], subject: str) -> None:
    """Check the value of a percept.

    Args:
        kind: Kind of percept.
        value: Its value.
        size: Width and height of the frame, pixels.
        subject: Name of the behaviour, for the message.

    Raises:
        BehaviourError: It is not valid.
    """
    check = VALUE_CHECKS.get(kind)
    if check is None:
        _check_plain(value, subject)
        return
    kind_type, check_of_kind = check
    expect(
        isinstance(value, kind_type),
        f"{subject} as {type_with_article(value)}",
        _with_article(kind_type),
    )
    check_of_kind(value, size)


def _region(r: Region, size: tuple[int, int]) -> None:
    subject = f"region {brief(r.id)}"
    expect(
        isinstance(r.id, int) and _is_integer(r.id) and r.id >= 1,
        f"{subject} has no number",
        "an id from 1",
    )
    expect(
        isinstance(r.bbox, tuple) and len(r.bbox) == 4 and all(_is_integer(v) for v in r.bbox),
        f"{subject} has box {brief(r.bbox)}",
        "(x, y, width, height) in whole pixels",
    )
    x, y, w, h = r.bbox
    inside = x >= 0 and y >= 0 and w > 0 and h > 0 and x + w <= size[0] and y + h <= size[1]
    shape = getattr(r.mask, "shape", None)
    expect(
        inside and shape == (h, w),
        f"{subject} has box {r.bbox} and a mask of {brief(shape)}",
        f"a box within {size} and a mask of (height, width) of the box",
    )
    expect(r.mask.dtype == np.bool_, f"{subject} has a mask of {r.mask.dtype}", "a mask of bool")
    expect(bool(r.mask.any()), f"{subject} has an empty mask", "at least one pixel")
    _array(r.contour, f"{subject}: contour", (None, 2))
    if r.motion is not None:
        _array(r.motion, f"{subject}: motion", (2, 3))
    for name, value in (("centroid", r.centroid), ("velocity", r.velocity)):
        pair = isinstance(value, tuple) and len(value) == 2 and all(is_finite(v) for v in value)
        expect(pair, f"{subject} has {name} {brief(value)}", "(x, y), two finite numbers")
    for name, number in (("area", r.area), ("velocity_sigma", r.velocity_sigma)):
        expect(
            _is_at_least(number, 0.0),
            f"{subject} has {name} {brief(number)}",
            "a number, at least 0",
        )
    expect(_is_share(r.confidence), f"{subject} has confidence {brief(r.confidence)}", "0 to 1")


def _hypothesis(h: Hypothesis, size: tuple[int, int]) -> None:
    subject = f"hypothesis of region {brief(h.region_id)}"
    expect(_is_integer(h.region_id), f"{subject} has no region", "the id of a region of this frame")
    expect(
        isinstance(h.name, str) and bool(h.name), f"{subject} has no name", "the name of a model"
    )
    expect(_is_integer(h.view), f"{subject} has view {brief(h.view)}", "the number of a view")
    expect(_is_share(h.similarity), f"{subject} has similarity {brief(h.similarity)}", "0 to 1")
    for name, value in (("rotation", h.rotation), ("scale", h.scale)):
        valid = value is None or is_finite(value)
        expect(valid, f"{subject} has {name} {brief(value)}", "a finite number, or None")
    expect(
        isinstance(h.of_kind, bool), f"{subject} has of_kind {brief(h.of_kind)}", "true or false"
    )
    if h.direction is not None:
        _array(h.direction, f"{subject}: direction", (3,))


def _depth(d: Depth, size: tuple[int, int]) -> None:
    subject = f"depth of region {brief(d.region_id)}"
    expect(_is_integer(d.region_id), f"{subject} has no region", "the id of a region of this frame")
    expect(isinstance(d.name, str), f"{subject} has name {brief(d.name)}", "the name of a model")
    positive = is_finite(d.depth) and d.depth > 0
    expect(positive, f"{subject} is {brief(d.depth)}", "a finite number above 0")
    expect(
        _is_at_least(d.sigma, 0.0), f"{subject} has sigma {brief(d.sigma)}", "a number, at least 0"
    )


def _camera(c: CameraMotion, size: tuple[int, int]) -> None:
    _array(c.motion, "camera: motion", (2, 3))
    turn = float(np.linalg.det(c.motion[:, :2]))
    expect(
        turn > 0.0, f"camera: motion with determinant {turn:.3g}", "one above 0: it can be undone"
    )


def _health(h: Health, size: tuple[int, int]) -> None:
    valid = isinstance(h.status, HealthStatus) and isinstance(h.detail, str)
    expect(valid, f"health has status {brief(h.status)}", "a HealthStatus and a sentence")


VALUE_CHECKS: Mapping[str, tuple[type, Callable[[Any, tuple[int, int]], None]]] = {
    "region": (Region, _region),
    "hypothesis": (Hypothesis, _hypothesis),
    "depth": (Depth, _depth),
    "camera": (CameraMotion, _camera),
    "health": (Health, _health),
}
"""Kind -> type of its values, and their check."""


def _check_plain(value: object, subject: str, depth: int = 0) -> None:
    """Check a value of a plug-in's own kind: plain data with finite numbers; missing values are None."""
    expect(depth <= DEEPEST, f"{subject} nested too deep", f"at most {DEEPEST} levels")
    if isinstance(value, int) and not isinstance(value, Enum):
        expect(
            value.bit_length() <= MAX_BITS,
            f"{subject} with a number of {value.bit_length()} bits",
            f"at most {MAX_BITS}",
        )
        return
    if value is None or isinstance(value, str | bytes | Enum | np.integer | np.bool_):
        return
    if isinstance(value, float | np.floating):
        expect(bool(np.isfinite(value)), f"{subject} as {value}", "a finite number, or None")
    elif isinstance(value, np.ndarray):
        _check_plain_array(value, subject)
    else:
        for part in _parts(value, subject):
            _check_plain(part, subject, depth + 1)


def _parts(value: object, subject: str) -> Iterable[object]:
    if isinstance(value, Mapping):
        return (*value.keys(), *value.values())
    if isinstance(value, tuple | list | set | frozenset):
        return value
    if is_dataclass(value) and not isinstance(value, type):
        return [getattr(value, f.name) for f in fields(value)]
    raise BehaviourError(
        f"{subject} with {type_with_article(value)} in it",
        expected="numbers, text, arrays, and lists, dicts or dataclasses of these",
    )


def _check_plain_array(value: NDArray[Any], subject: str) -> None:
    expect(
        value.dtype.kind in "biufSU", f"{subject} as an array of {value.dtype}", "numbers or text"
    )
    if value.dtype.kind == "f":
        # The masked elements of a masked array are missing values.
        known = value.compressed() if isinstance(value, np.ma.MaskedArray) else value
        expect(
            bool(np.isfinite(known).all()),
            f"{subject} with numbers that are not finite",
            "finite numbers; mask what was not measured with numpy.ma",
        )


def _array(value: Any, subject: str, shape: tuple[int | None, ...]) -> None:
    try:
        found = np.asarray(value)
    except ValueError:
        found = np.empty((), dtype=object)  # rows of different lengths
    matches = len(found.shape) == len(shape) and all(
        side in (None, found_side) for side, found_side in zip(shape, found.shape, strict=True)
    )
    expected_shape = ", ".join("N" if n is None else str(n) for n in shape)
    expect(matches, f"{subject} has shape {found.shape}", f"({expected_shape})")
    numbers = found.dtype.kind in "iuf" and bool(np.isfinite(found).all())
    expect(numbers, f"{subject} contains a number that is not finite", "finite numbers")


def expect(condition: bool, what: str, expected: str) -> None:
    """Raise unless a condition holds.

    Raises:
        BehaviourError: It does not.
    """
    if not condition:
        raise BehaviourError(what, expected=expected)


def is_finite(value: object) -> bool:
    """Whether a value is a finite number."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    return is_number and not isinstance(value, bool) and math.isfinite(value)  # type: ignore[arg-type]


def _is_at_least(value: object, least: float) -> bool:
    return is_finite(value) and value >= least  # type: ignore[operator]


def _is_share(value: object) -> bool:
    return is_finite(value) and 0.0 <= value <= 1.0  # type: ignore[operator]


def _is_integer(value: object) -> bool:
    is_int = isinstance(value, int | np.integer) and not isinstance(value, bool)
    return is_int and abs(int(value)) < 2**63  # type: ignore[call-overload]


def type_with_article(value: object) -> str:
    """The type of a value with its article."""
    return "nothing (None)" if value is None else _with_article(type(value))


def _with_article(kind: type) -> str:
    return f"{'an' if kind.__name__[:1].lower() in 'aeiou' else 'a'} {kind.__name__}"


def brief(value: object) -> str:
    """A value for a message, short and on one line."""
    text = value if isinstance(value, str) else repr(value)
    return " ".join(text.split())[:60]
