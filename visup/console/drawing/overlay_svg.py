"""The switchable overlays of the picture: zones, trails, relations as lines between objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape

from visup.agent import Mind, ObjectBelief, Presence, Truth, Zone
from visup.report.palette import css, object_colour

DRAWN = ("coupled", "touching", "moving_together", "converging", "diverging", "keeping_distance")
"""Relations that are drawn, closest first; for two objects the first that holds."""

MOST_VECTORS = 14
LETTERS = 0.026
"""Font size as a share of the picture's height."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class RelationVector:
    """A relation that holds between two objects.

    Attributes:
        name: Name of the relation.
        objects: Ids.
        ends: Centres of the objects, pixels.
    """

    name: str
    objects: tuple[int, int]
    ends: tuple[Point, Point]


def vectors_of(mind: Mind) -> tuple[RelationVector, ...]:
    """The closest relation of each pair of visible objects, the closest pairs first."""
    visible = {b.id: b for b in mind.present() if b.presence is Presence.SEEN}
    ids = sorted(visible)
    pairs = [(a, b) for i, a in enumerate(ids) for b in ids[i + 1 :]]
    found = [(rank, pair) for pair in pairs if (rank := _closest(mind, *pair)) is not None]
    chosen = sorted(found, key=lambda f: (f[0], _distance(*(visible[i] for i in f[1]))))[
        :MOST_VECTORS
    ]
    return tuple(
        RelationVector(DRAWN[rank], pair, (_centre(visible[pair[0]]), _centre(visible[pair[1]])))
        for rank, pair in chosen
    )


def _closest(mind: Mind, a: int, b: int) -> int | None:
    """Index of the first relation of `DRAWN` that holds between two objects, or None."""
    if mind.coupled(a, b):
        return 0
    indices = (k for k, name in enumerate(DRAWN) if mind.truth(name, a, b) is Truth.TRUE)
    return next(indices, None)


def _centre(belief: ObjectBelief) -> Point:
    return belief.region.centroid


def _distance(a: ObjectBelief, b: ObjectBelief) -> float:
    (ax, ay), (bx, by) = _centre(a), _centre(b)
    return float((ax - bx) ** 2 + (ay - by) ** 2)


def overlay_svg(
    mind: Mind,
    vectors: Iterable[RelationVector] = (),
    trails: Mapping[int, Sequence[Point]] | None = None,
    drawn: Sequence[Point] = (),
    chosen: int | None = None,
) -> str:
    """The overlay of a moment.

    Args:
        mind: The beliefs; its zones are drawn.
        vectors: Relations.
        trails: Object -> past positions, pixels, oldest first.
        drawn: Corners of a zone that is being drawn.
        chosen: The object that was clicked.

    Returns:
        An SVG element that scales like the picture.
    """
    width, height = mind.frame_size
    letters = max(9.0, LETTERS * height)
    parts = [
        *(_zone(z, letters) for z in mind.zones),
        *(_trail(number, points) for number, points in (trails or {}).items()),
        *(_vector(v, letters) for v in vectors),
        _drawn(drawn, letters),
        _frame(mind.objects.get(chosen)) if chosen is not None else "",
    ]
    return (
        f'<svg class="overlay" viewBox="0 0 {width} {height}" preserveAspectRatio="xMidYMid meet" '
        f'aria-hidden="true">{"".join(parts)}</svg>'
    )


def _points(points: Iterable[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _zone(zone: Zone, letters: float) -> str:
    x = sum(p[0] for p in zone.polygon) / len(zone.polygon)
    y = sum(p[1] for p in zone.polygon) / len(zone.polygon)
    return f'<polygon class="zone" points="{_points(zone.polygon)}"/>' + _text(
        zone.name, (x, y), letters
    )


def _trail(number: int, points: Sequence[Point]) -> str:
    colour = css(object_colour(number))
    return f'<polyline class="trail" points="{_points(points)}" stroke="{colour}"/>'


def _vector(vector: RelationVector, letters: float) -> str:
    (ax, ay), (bx, by) = vector.ends
    ends = f'x1="{ax:.1f}" y1="{ay:.1f}" x2="{bx:.1f}" y2="{by:.1f}"'
    knobs = "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{letters / 4:.1f}"/>' for x, y in vector.ends
    )
    label = _text(vector.name.replace("_", " "), ((ax + bx) / 2, (ay + by) / 2), letters)
    return (
        f'<g class="vector {escape(vector.name, quote=True)}"><line class="edge" {ends}/>'
        f"<line {ends}/>{knobs}{label}</g>"
    )


def _text(words: str, at: Point, letters: float) -> str:
    return (
        f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" font-size="{letters:.1f}" text-anchor="middle" '
        f'stroke-width="{letters / 4:.1f}">{escape(words)}</text>'
    )


def _drawn(points: Sequence[Point], letters: float) -> str:
    if not points:
        return ""
    corners = "".join(
        f'<circle class="corner" cx="{x:.1f}" cy="{y:.1f}" r="{letters / 3:.1f}"/>'
        for x, y in points
    )
    return f'<polygon class="zone drawn" points="{_points(points)}"/>{corners}'


def _frame(belief: ObjectBelief | None) -> str:
    """Corner marks around the clicked object."""
    if belief is None:
        return ""
    x, y, w, h = belief.region.bbox
    return f'<rect class="chosen" x="{x - 4}" y="{y - 4}" width="{w + 8}" height="{h + 8}" rx="6"/>'
