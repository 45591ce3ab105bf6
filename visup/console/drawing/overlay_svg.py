"""The switchable overlays of the picture: zones, trails, relations as lines between objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

from visup.agent import Mind, ObjectBelief, Presence, Truth, Zone
from visup.report.palette import css, object_colour

DRAWN_RELATIONS = (
    "coupled",
    "touching",
    "moving_together",
    "converging",
    "diverging",
    "keeping_distance",
)
"""Relations that are drawn, closest first; for two objects the first that holds."""

MAX_RELATION_LINES = 14
FONT_SIZE = 0.026
"""Font size as a share of the picture's height."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class RelationLine:
    """A relation that holds between two objects.

    Attributes:
        name: Name of the relation.
        objects: Ids.
        ends: Centres of the objects, pixels.
    """

    name: str
    objects: tuple[int, int]
    ends: tuple[Point, Point]


def relation_lines(mind: Mind) -> tuple[RelationLine, ...]:
    """The closest relation of each pair of visible objects, the closest pairs first."""
    visible = {b.id: b for b in mind.present() if b.presence is Presence.SEEN}
    ids = sorted(visible)
    pairs = [(a, b) for i, a in enumerate(ids) for b in ids[i + 1 :]]
    found = [(rank, pair) for pair in pairs if (rank := _closest(mind, *pair)) is not None]
    closest = sorted(found, key=lambda f: (f[0], _distance(*(visible[i] for i in f[1]))))[
        :MAX_RELATION_LINES
    ]
    return tuple(
        RelationLine(
            DRAWN_RELATIONS[rank], pair, (_centre(visible[pair[0]]), _centre(visible[pair[1]]))
        )
        for rank, pair in closest
    )


def _closest(mind: Mind, a: int, b: int) -> int | None:
    """Index of the first relation of `DRAWN_RELATIONS` that holds between two objects, or None."""
    if mind.coupled(a, b):
        return 0
    indices = (k for k, name in enumerate(DRAWN_RELATIONS) if mind.truth(name, a, b) is Truth.TRUE)
    return next(indices, None)


def _centre(belief: ObjectBelief) -> Point:
    return belief.region.centroid


def _distance(a: ObjectBelief, b: ObjectBelief) -> float:
    (ax, ay), (bx, by) = _centre(a), _centre(b)
    return float((ax - bx) ** 2 + (ay - by) ** 2)


def overlay_svg(
    mind: Mind,
    lines: Iterable[RelationLine] = (),
    trails: Mapping[int, Sequence[Point]] | None = None,
    zone_corners: Sequence[Point] = (),
    selected: int | None = None,
) -> str:
    """The overlay of a moment.

    Args:
        mind: The beliefs; its zones are drawn.
        lines: Relations.
        trails: Object -> past positions, pixels, oldest first.
        zone_corners: Corners of a zone that is being drawn.
        selected: The object that was clicked.

    Returns:
        An SVG element that scales like the picture.
    """
    width, height = mind.frame_size
    font_size = max(9.0, FONT_SIZE * height)
    parts = [
        *(_zone(z, font_size) for z in mind.zones),
        *(_trail(number, points) for number, points in (trails or {}).items()),
        *(_relation_line(v, font_size) for v in lines),
        _unfinished_zone(zone_corners, font_size),
        _selection(mind.objects.get(selected)) if selected is not None else "",
    ]
    return (
        f'<svg class="overlay" viewBox="0 0 {width} {height}" preserveAspectRatio="xMidYMid meet" '
        f'aria-hidden="true">{"".join(parts)}</svg>'
    )


def _points(points: Iterable[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _zone(zone: Zone, font_size: float) -> str:
    x = sum(p[0] for p in zone.polygon) / len(zone.polygon)
    y = sum(p[1] for p in zone.polygon) / len(zone.polygon)
    return f'<polygon class="zone" points="{_points(zone.polygon)}"/>' + _text(
        zone.name, (x, y), font_size
    )


def _trail(number: int, points: Sequence[Point]) -> str:
    colour = css(object_colour(number))
    return f'<polyline class="trail" points="{_points(points)}" stroke="{colour}"/>'


def _relation_line(line: RelationLine, font_size: float) -> str:
    (ax, ay), (bx, by) = line.ends
    ends = f'x1="{ax:.1f}" y1="{ay:.1f}" x2="{bx:.1f}" y2="{by:.1f}"'
    end_dots = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{font_size / 4:.1f}"/>' for x, y in line.ends
    )
    label = _text(line.name.replace("_", " "), ((ax + bx) / 2, (ay + by) / 2), font_size)
    return (
        f'<g class="vector {escape(line.name, quote=True)}"><line class="edge" {ends}/>'
        f"<line {ends}/>{end_dots}{label}</g>"
    )


def _text(text: str, position: Point, font_size: float) -> str:
    return (
        f'<text x="{position[0]:.1f}" y="{position[1]:.1f}" font-size="{font_size:.1f}" text-anchor="middle" '
        f'stroke-width="{font_size / 4:.1f}">{escape(text)}</text>'
    )


def _unfinished_zone(points: Sequence[Point], font_size: float) -> str:
    if not points:
        return ""
    corners = "".join(
        f'<circle class="corner" cx="{x:.1f}" cy="{y:.1f}" r="{font_size / 3:.1f}"/>'
        for x, y in points
    )
    return f'<polygon class="zone drawn" points="{_points(points)}"/>{corners}'


def _selection(belief: ObjectBelief | None) -> str:
    """Corner marks around the clicked object."""
    if belief is None:
        return ""
    x, y, w, h = belief.region.bbox
    return f'<rect class="chosen" x="{x - 4}" y="{y - 4}" width="{w + 8}" height="{h + 8}" rx="6"/>'
