"""Seventeen objects that are neither satellite nor arm, as distractors for recognition by outline.

All are built from primitives, upright along z, one to a few metres in size.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

from visup.render.meshes.animals import ANIMALS
from visup.render.meshes.solids import (
    Colour,
    Solid,
    ball,
    box,
    cone,
    join,
    lathe,
    limb,
    mirrored,
    plate,
    rod,
)

WOOD: Colour = (0.55, 0.38, 0.22)
METAL: Colour = (0.55, 0.56, 0.58)
WHITE: Colour = (0.80, 0.80, 0.78)
BLUE: Colour = (0.14, 0.18, 0.42)
RED: Colour = (0.60, 0.14, 0.12)
DARK: Colour = (0.12, 0.12, 0.13)


def guitar() -> Solid:
    """A guitar: two bouts with a waist, a neck and a head."""
    body = [
        ((0.2 + 0.055 * cos(2 * a) + 0.02 * cos(a)) * sin(a), -0.30 * cos(a)) for a in _angles(48)
    ]
    waisted = [(x * (1 - 0.28 * _bump(z, 0.04, 0.10)), z) for x, z in body]
    return join(
        plate([(x, z) for x, z in waisted][::-1], 0.12, WOOD).moved(turn=(90, 0, 0)),
        cone((0, -0.065, -0.02), (0, -0.06, -0.02), 0.06, None, DARK),
        box((0.055, 0.035, 0.52), (0, -0.05, 0.52), DARK),
        box((0.1, 0.03, 0.17), (0, -0.04, 0.85), WOOD),
        box((0.16, 0.03, 0.03), (0, -0.075, -0.16), DARK),
        mirrored(join(*(ball(0.02, (0.065, -0.04, z), METAL) for z in (0.8, 0.85, 0.9))), axis=0),
    )


def umbrella() -> Solid:
    """An open umbrella with a crook."""
    profile = [(0.62 * sin(a), 0.36 * cos(a)) for a in (0.0, 0.3, 0.6, 0.9, 1.2, 1.45)]
    canopy = lathe([(r, z + 0.45) for r, z in profile], RED, sections=16)
    crook = [
        (0.07 * cos(a) + 0.07, 0.0, -0.42 + 0.07 * sin(a))
        for a in (pi, pi * 1.33, pi * 1.67, 2 * pi)
    ]
    return join(
        canopy,
        rod((0, 0, -0.42), (0, 0, 0.9), 0.015, None, METAL),
        limb(crook, [0.022] * 4, WOOD),
    )


def teapot() -> Solid:
    """A teapot with spout, handle and knob."""
    belly = [(0, 0), (0.26, 0.0), (0.36, 0.14), (0.36, 0.24), (0.28, 0.4), (0.16, 0.46), (0, 0.47)]
    handle = [
        (-0.3, 0, 0.34),
        (-0.48, 0, 0.38),
        (-0.54, 0, 0.26),
        (-0.46, 0, 0.14),
        (-0.32, 0, 0.1),
    ]
    return join(
        lathe(belly, WHITE),
        ball(0.05, (0, 0, 0.51), WHITE),
        limb([(0.3, 0, 0.14), (0.46, 0, 0.22), (0.58, 0, 0.42)], [0.1, 0.06, 0.035], WHITE),
        limb(handle, [0.03] * 5, WHITE),
    )


def cup() -> Solid:
    """A cup with a handle on a saucer."""
    wall = [(0.12, 0.04), (0.2, 0.12), (0.26, 0.42), (0.24, 0.42), (0.18, 0.14), (0.0, 0.08)]
    handle = [(0.24, 0, 0.36), (0.38, 0, 0.34), (0.4, 0, 0.22), (0.22, 0, 0.16)]
    return join(
        lathe([(0, 0.04), *wall], WHITE),
        limb(handle, [0.025] * 4, WHITE),
        lathe([(0, 0), (0.15, 0.0), (0.38, 0.06), (0.38, 0.075), (0.15, 0.02), (0, 0.02)], WHITE),
    )


def chair() -> Solid:
    """A kitchen chair with a slatted back."""
    legs = [
        rod((x, y, 0), (0.9 * x, 0.9 * y, 0.45), 0.025, None, WOOD)
        for x in (-0.2, 0.2)
        for y in (-0.2, 0.2)
    ]
    posts = [rod((-0.2, y, 0.45), (-0.27, y, 0.98), 0.025, None, WOOD) for y in (-0.18, 0.18)]
    slats = [
        box((0.03, 0.36, 0.07), (-0.2 - dx, 0, z), WOOD) for dx, z in ((0.03, 0.7), (0.06, 0.9))
    ]
    return join(box((0.46, 0.44, 0.05), (0, 0, 0.47), WOOD), *legs, *posts, *slats)


def lamp() -> Solid:
    """A desk lamp: a foot, two struts and a shade."""
    shade = lathe([(0.05, 0.12), (0.06, 0.1), (0.17, -0.08), (0.16, -0.08), (0.0, 0.09)], BLUE)
    return join(
        lathe([(0, 0), (0.2, 0), (0.2, 0.03), (0.05, 0.06), (0, 0.06)], DARK),
        rod((0, 0, 0.05), (-0.18, 0, 0.45), 0.02, None, METAL),
        rod((-0.18, 0, 0.45), (0.22, 0, 0.74), 0.02, None, METAL),
        ball(0.04, (-0.18, 0, 0.45), DARK),
        shade.moved(by=(0.26, 0, 0.68), turn=(0, -25, 0)),
    )


def hammer() -> Solid:
    """A claw hammer."""
    claw = [
        limb(
            [(-0.05, y, 0.86), (-0.15, 2 * y, 0.85), (-0.25, 2 * y, 0.78)],
            [0.05, 0.03, 0.01],
            METAL,
        )
        for y in (-0.02, 0.02)
    ]
    return join(
        rod((0, 0, 0), (0, 0, 0.35), 0.04, 0.035, RED),
        rod((0, 0, 0.35), (0, 0, 0.85), 0.028, None, WOOD),
        cone((-0.07, 0, 0.86), (0.12, 0, 0.86), 0.05, None, METAL),
        cone((0.12, 0, 0.86), (0.2, 0, 0.86), 0.065, None, METAL),
        *claw,
    )


def airplane() -> Solid:
    """A low-winged airliner with two engines."""
    wing = plate([(0.12, 0.0), (-0.22, 1.0), (-0.34, 1.0), (-0.22, 0.0)], 0.03, METAL)
    stabiliser = plate([(-0.72, 0.0), (-0.88, 0.34), (-0.96, 0.34), (-0.92, 0.0)], 0.02, METAL)
    fin = plate([(-0.62, 0.0), (-0.86, 0.36), (-0.98, 0.36), (-0.9, 0.0)], 0.02, BLUE)
    return join(
        limb(
            [(-0.95, 0, 0.03), (-0.6, 0, 0), (0.75, 0, 0), (0.95, 0, -0.02)],
            [0.03, 0.1, 0.1, 0.05],
            WHITE,
        ),
        mirrored(wing.moved(by=(0, 0, -0.05))),
        mirrored(stabiliser.moved(by=(0, 0, 0.04))),
        fin.moved(turn=(90, 0, 0), by=(0, 0, 0.05)),
        mirrored(cone((0.14, 0.35, -0.12), (-0.1, 0.35, -0.12), 0.055, 0.04, DARK)),
    )


def dish() -> Solid:
    """A dish antenna on a mount, with its feed on three struts."""
    bowl = [
        (0, 0),
        (0.2, 0.02),
        (0.4, 0.09),
        (0.6, 0.2),
        (0.6, 0.22),
        (0.4, 0.11),
        (0.2, 0.04),
        (0, 0.02),
    ]
    struts = [
        rod((0.55 * cos(a), 0.55 * sin(a), 0.18), (0, 0, 0.55), 0.012, None, METAL)
        for a in (0.5, 0.5 + 2 * pi / 3, 0.5 + 4 * pi / 3)
    ]
    head = join(
        lathe(bowl, WHITE),
        *struts,
        ball(0.05, (0, 0, 0.55), DARK),
        box((0.2, 0.2, 0.16), (0, 0, -0.06), METAL),
    )
    return join(
        head.moved(turn=(0, 50, 0), by=(0.05, 0, 0.75)),
        cone((0, 0, 0.05), (0, 0, 0.72), 0.07, 0.05, METAL),
        lathe([(0, 0), (0.3, 0), (0.3, 0.05), (0, 0.06)], METAL),
    )


def station() -> Solid:
    """A space station: a truss with four pairs of solar panels and a row of modules."""
    panels = [
        box((0.9, 0.3, 0.02), (side * 0.75, y, 0), BLUE)
        for y in (-1.75, -1.3, 1.3, 1.75)
        for side in (-1, 1)
    ]
    modules = join(
        cone((-0.9, 0, -0.25), (0.8, 0, -0.25), 0.16, None, WHITE),
        cone((0.3, -0.5, -0.25), (0.3, 0.5, -0.25), 0.15, None, WHITE),
        ball(0.18, (-0.5, 0, -0.25), METAL),
        cone((-0.5, 0, -0.25), (-0.5, 0, -0.75), 0.13, None, WHITE),
    )
    masts = [box((1.1, 0.04, 0.04), (0, y, 0), METAL) for y in (-1.75, -1.3, 1.3, 1.75)]
    radiators = [box((0.5, 0.35, 0.02), (-0.3, y, 0.02), WHITE) for y in (-0.55, 0.55)]
    return join(box((0.16, 4.0, 0.16), (0, 0, 0), METAL), modules, *panels, *masts, *radiators)


def ladder() -> Solid:
    """A step ladder, opened."""
    rails = [box((0.04, 0.04, 1.3), (0, y, 0), METAL) for y in (-0.22, 0.22)]
    rungs = [box((0.08, 0.44, 0.03), (0, 0, -0.5 + 0.22 * k), METAL) for k in range(5)]
    brace = [rod((0.18, y, -0.58), (-0.06, y, 0.6), 0.018, None, METAL) for y in (-0.2, 0.2)]
    front = join(*rails, *rungs).moved(turn=(0, 14, 0), by=(-0.2, 0, 0))
    back = join(*brace, rod((0.18, -0.2, -0.5), (0.18, 0.2, -0.5), 0.018, None, METAL))
    return join(
        front, back.moved(by=(0.1, 0, 0.02)), box((0.24, 0.46, 0.04), (-0.02, 0, 0.64), RED)
    )


def astronaut() -> Solid:
    """An astronaut with a life support pack, arms held out."""
    arm = limb([(0, 0.24, 1.35), (0.12, 0.5, 1.2), (0.36, 0.52, 1.22)], [0.11, 0.09, 0.07], WHITE)
    leg = limb([(0, 0.12, 0.85), (0.08, 0.16, 0.48), (0.0, 0.17, 0.08)], [0.14, 0.11, 0.09], WHITE)
    boot = ball((0.17, 0.09, 0.07), (0.06, 0.17, 0.05), WHITE)
    return join(
        limb([(0, 0, 0.9), (0, 0, 1.35)], [0.2, 0.23], WHITE),
        ball(0.19, (0.02, 0, 1.68), WHITE),
        ball((0.12, 0.14, 0.13), (0.1, 0, 1.68), DARK),
        box((0.26, 0.52, 0.85), (-0.3, 0, 1.28), METAL),
        mirrored(join(arm, leg, boot)),
    )


def espresso() -> Solid:
    """A stove-top espresso maker: eight-sided, waisted, with a spout and a handle."""
    pot = [
        (0, 0),
        (0.24, 0),
        (0.17, 0.4),
        (0.19, 0.44),
        (0.15, 0.48),
        (0.25, 0.86),
        (0.05, 0.95),
        (0, 0.95),
    ]
    return join(
        lathe(pot, METAL, sections=8),
        ball(0.045, (0, 0, 0.99), DARK),
        plate([(0.2, 0.62), (0.36, 0.86), (0.2, 0.86)], 0.08, METAL).moved(turn=(90, 0, 0)),
        limb([(-0.2, 0, 0.8), (-0.42, 0, 0.82), (-0.44, 0, 0.45)], [0.03, 0.035, 0.03], DARK),
    )


def _angles(count: int) -> list[float]:
    return [2 * pi * k / count for k in range(count)]


def _bump(at: float, middle: float, width: float) -> float:
    """1 at the middle, falling to 0 at a width from it."""
    distance = abs(at - middle) / width
    return 0.0 if distance >= 1 else 0.5 + 0.5 * cos(pi * distance)


DISTRACTORS: dict[str, Callable[[], Solid]] = {
    **ANIMALS,
    "guitar": guitar,
    "umbrella": umbrella,
    "teapot": teapot,
    "cup": cup,
    "chair": chair,
    "lamp": lamp,
    "hammer": hammer,
    "airplane": airplane,
    "dish": dish,
    "station": station,
    "ladder": ladder,
    "astronaut": astronaut,
    "espresso": espresso,
}
