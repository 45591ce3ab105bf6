"""Zone files (TOML): parts of the scene, drawn by hand, that rules can name.

The format is described in ``docs/formats.md``.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import VisupError, Zone
from visup.agent.model.errors import ErrorGroup, SettingsError
from visup.agent.storage.text_file import read_text_file
from visup.rules.geometry.ground import Floats, projected
from visup.tasks.actions.floor import floor_map
from visup.tasks.grammar.nodes import Ground, Number

_NAME = re.compile(r"[A-Za-z_]\w*")
_KEYS = ("name", "polygon", "floor", "depth")
_GROUND = (
    "[ground], image = [[80, 400], ...], floor = [[0, 0], ...], four points or more, in metres"
)
_EXAMPLE = '[[zone]], name = "dock", polygon = [[100, 80], [300, 80], [300, 240], [100, 240]]'


def load_zones(path: Path) -> tuple[Zone, ...]:
    """Load the zones of a file; all errors are reported together.

    Raises:
        SettingsError: The file cannot be read, or is no zone file.
        ErrorGroup: Several zones are not valid.
    """
    return read_zones(_text(path), str(path))


def read_zones(text: str, path: str) -> tuple[Zone, ...]:
    """Parse the zones in the text of a file; all errors are reported together.

    Args:
        text: TOML.
        path: Its name, for messages.

    Raises:
        SettingsError: It is no zone file.
        ErrorGroup: Several zones are not valid.
    """
    entries, ground_value = _entries(text, path)
    ground = _ground(ground_value, path)
    to_floor = None if ground is None else floor_map(ground)
    zones: list[Zone] = []
    faults: list[VisupError] = []
    for number, entry in enumerate(entries, start=1):
        try:
            zone = _zone(entry, f"{path}, zone {number}", to_floor)
            if zone.name in (z.name for z in zones):
                raise SettingsError(
                    f"two zones are called '{zone.name}'",
                    where=f"{path}, zone {number}",
                    expected="a name of its own for each zone",
                )
            zones.append(zone)
        except SettingsError as fault:
            faults.append(fault)
    if len(faults) > 1:
        raise ErrorGroup(faults)
    if faults:
        raise faults[0]
    return tuple(zones)


def load_ground(path: Path) -> Ground | None:
    """The mapping from the image to the floor, or None if the file has none.

    Raises:
        SettingsError: The file cannot be read, or its ground is not valid.
    """
    return _ground(_entries(_text(path), str(path))[1], str(path))


def zones_text(zones: Iterable[Zone]) -> str:
    """A zone file for `read_zones`; zones on the floor are written in image coordinates."""
    return "\n".join(map(_zone_text, zones))


def _zone_text(zone: Zone) -> str:
    corners = ", ".join(f"[{float(x)!r}, {float(y)!r}]" for x, y in zone.polygon)
    depth = f"depth = [{', '.join(map(repr, zone.depth))}]\n" if zone.depth else ""
    return f'[[zone]]\nname = "{zone.name}"\npolygon = [{corners}]\n{depth}'


def _ground(value: object, path: str) -> Ground | None:
    if value is None:
        return None
    where, table = f"{path}, ground", value if isinstance(value, dict) else {}
    sides = [table.get(key) for key in ("image", "floor")]
    image, floor = (
        tuple(_pair(p) for p in side) if isinstance(side, list) else () for side in sides
    )
    valid = len(image) == len(floor) >= 4 and all(image) and all(floor)
    if not valid or set(table) - {"image", "floor"}:
        raise SettingsError("the ground is invalid", where=where, expected=_GROUND)
    metres = tuple((Number(p[0], "m"), Number(p[1], "m")) for p in floor if p is not None)
    ground = Ground(tuple(p for p in image if p is not None), metres)
    if floor_map(ground) is None:
        what = "three of the points lie on a line, so they do not determine the floor"
        raise SettingsError(what, where=where, expected="such as the corners of a rectangle")
    return ground


def _text(path: Path) -> str:
    try:
        return read_text_file(path)
    except OSError as fault:
        raise SettingsError(
            f"the zones cannot be read: {fault.strerror}", where=str(path)
        ) from fault
    except UnicodeDecodeError as fault:
        raise SettingsError("the file is not text", where=str(path), expected="TOML") from fault


def _entries(text: str, path: str) -> tuple[list[Any], object]:
    try:
        found = tomllib.loads(text)
    except (ValueError, RecursionError) as fault:  # also numbers and tables that are too large
        raise SettingsError(f"this is not TOML: {fault}", where=path) from fault
    entries, ground = found.pop("zone", None), found.pop("ground", None)
    if found:
        raise SettingsError(
            f"'{next(iter(found))}' is not known here", where=path, expected="[[zone]]"
        )
    if entries is None and ground is not None:
        return [], ground
    if not isinstance(entries, list) or not entries:
        raise SettingsError("there is no zone in it", where=path, expected=_EXAMPLE)
    return entries, ground


def _zone(entry: object, where: str, to_floor: Floats | None) -> Zone:
    if not isinstance(entry, dict):
        raise SettingsError("this is not a zone", where=where, expected=_EXAMPLE)
    unknown = next((key for key in entry if key not in _KEYS), None)
    if unknown is not None:
        raise SettingsError(
            f"'{unknown}' is not known here", where=where, expected=f"one of: {', '.join(_KEYS)}"
        )
    name = entry.get("name")
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise SettingsError(
            f"the name is {name!r}" if "name" in entry else "the zone has no name",
            where=where,
            expected='a word of letters, digits and _, such as name = "dock"',
        )
    where = f"{where} ('{name}')"
    if "floor" in entry:
        floor = _polygon(entry["floor"], where, "metres", min_area=1e-6)
        return Zone(
            name,
            _in_image(floor, to_floor, where),
            _depth(entry.get("depth"), where),
            on_floor=True,
        )
    return Zone(name, _polygon(entry.get("polygon"), where), _depth(entry.get("depth"), where))


def _in_image(
    floor: tuple[tuple[float, float], ...], to_floor: Floats | None, where: str
) -> tuple[tuple[float, float], ...]:
    """A polygon of the floor in image coordinates."""
    if to_floor is None:
        what = "the zone is drawn on the floor, but nothing says where the floor is"
        raise SettingsError(what, where=where, expected=_GROUND)
    corners = projected(floor, np.linalg.inv(to_floor).astype(float))
    return tuple((float(x), float(y)) for x, y in corners)


def _polygon(
    value: object, where: str, unit: str = "pixels", min_area: float = 1.0
) -> tuple[tuple[float, float], ...]:
    corners = value if isinstance(value, list) else []
    points = tuple(_pair(c) for c in corners)
    if not all(points) or len(corners) < 3:
        raise SettingsError(
            f"the polygon has {len(corners)} corners"
            if corners and all(points)
            else "the polygon is not a list of corners",
            where=where,
            expected=f"at least three corners [x, y] in {unit}, in order",
        )
    polygon = tuple(p for p in points if p is not None)
    if area(polygon) < min_area:
        raise SettingsError(
            "the polygon encloses nothing", where=where, hint="give the corners in order"
        )
    return polygon


def area(polygon: tuple[tuple[float, float], ...]) -> float:
    """Area of a polygon, square pixels; 0 if its corners are collinear."""
    following = (*polygon[1:], polygon[0])
    double = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(polygon, following, strict=True))
    return abs(double) / 2.0


def _depth(value: object, where: str) -> tuple[float, float] | None:
    if value is None:
        return None
    depth = _pair(value)
    if depth is None or not 0.0 <= depth[0] < depth[1]:
        raise SettingsError(
            f"the range of depth is {value!r}",
            where=where,
            expected="depth = [nearest, farthest] in the models' units, 0 <= nearest < farthest",
        )
    return depth


def _pair(value: object) -> tuple[float, float] | None:
    if not isinstance(value, list) or len(value) != 2:
        return None
    if any(isinstance(v, bool) or not isinstance(v, int | float) for v in value):
        return None
    try:
        x, y = (float(v) for v in value)
    except OverflowError:  # an integer with hundreds of digits
        return None
    return (x, y) if math.isfinite(x) and math.isfinite(y) else None
