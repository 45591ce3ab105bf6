"""Thirteen machines, for recognition by outline and as unknown objects.

Each is built from primitives, upright along z, one to a few metres in size; parts overlap, which does not
change silhouettes.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

from visup.render.meshes.solids import (
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

Point = tuple[float, float, float]


def excavator() -> Solid:
    """An excavator: tracks, a cab, a bent boom with a bucket."""
    track = join(box((2.2, 0.4, 0.5), (0, 0.7, 0.3)), _wheel((-1.1, 0.7, 0.3), 0.25, 0.4))
    tracks = mirrored(join(track, _wheel((1.1, 0.7, 0.3), 0.25, 0.4)))
    body = join(box((1.9, 1.5, 0.6), (-0.3, 0, 0.95)), box((0.8, 0.6, 0.9), (0.3, 0.4, 1.5)))
    boom = limb([(0.5, 0, 1.1), (1.6, 0, 2.6), (2.6, 0, 2.5)], [0.16, 0.18, 0.13])
    stick = limb([(2.6, 0, 2.5), (3.3, 0, 1.0)], [0.13, 0.09])
    bucket = plate([(-0.3, -0.2), (0.2, -0.3), (0.4, 0.1), (0.1, 0.3), (-0.2, 0.3)], 0.7)
    return join(tracks, body, boom, stick, bucket.moved(turn=(90, 0, 0), by=(3.2, 0, 0.7)))


def forklift() -> Solid:
    """A forklift truck: a mast, two tines, a roof on four posts."""
    tine = box((1.1, 0.12, 0.06), (1.6, 0.25, 0.35))
    mast = join(box((0.12, 0.1, 2.3), (0.98, 0.3, 1.3)), tine)
    posts = [rod((x, 0.42, 0.9), (0.8 * x, 0.42, 2.0), 0.035) for x in (-0.55, 0.6)]
    wheels = [_wheel((x, 0.5, r), r, 0.2) for x, r in ((-0.65, 0.25), (0.65, 0.32))]
    sides = mirrored(join(mast, *posts, *wheels))
    body = join(box((1.7, 0.9, 0.6), (0, 0, 0.6)), box((0.5, 0.9, 0.35), (-0.7, 0, 0.95)))
    roof = box((1.1, 0.9, 0.06), (0, 0, 2.0))
    rungs = [box((0.1, 0.7, 0.08), (0.98, 0, z)) for z in (0.5, 1.6, 2.4)]
    return join(sides, body, roof, *rungs)


def quadcopter() -> Solid:
    """A drone: four arms with rotors, a body, skids and a camera."""
    arms = []
    for k in range(4):
        a = pi / 4 + k * pi / 2
        x, y = 0.45 * cos(a), 0.45 * sin(a)
        blade = plate([(-0.26, -0.015), (0.26, -0.03), (0.26, 0.015), (-0.26, 0.03)], 0.012)
        rotor = blade.moved(by=(x, y, 0.13), turn=(0, 0, 40 * k))
        arms += [rod((0, 0, 0), (x, y, 0.03), 0.025), cone((x, y, 0), (x, y, 0.13), 0.04), rotor]
    leg = limb([(0.1, 0.1, 0), (0.14, 0.22, -0.25)], [0.015, 0.015])
    skid = rod((-0.24, 0.22, -0.25), (0.24, 0.22, -0.25), 0.015)
    legs = mirrored(join(leg, leg.moved(by=(-0.24, 0, 0)), skid))
    return join(*arms, ball((0.2, 0.13, 0.07)), legs, ball(0.06, (0.13, 0, -0.1)))


def lander() -> Solid:
    """A lander: an eight-sided stage on four legs with pads, a cabin, a nozzle, a dish."""
    leg = join(
        rod((0.9, 0, 0.9), (1.9, 0, 0.1), 0.06),
        rod((0.9, 0.35, 0.5), (1.7, 0, 0.25), 0.04),
        rod((0.9, -0.35, 0.5), (1.7, 0, 0.25), 0.04),
        lathe([(0, 0), (0.3, 0.0), (0.3, 0.08), (0, 0.1)]).moved(by=(1.9, 0, 0)),
    )
    legs = [leg.moved(turn=(0, 0, 90 * k)) for k in range(4)]
    base = lathe([(0, 0.45), (1.05, 0.45), (1.05, 1.1), (0, 1.1)], sections=8)
    cabin = join(ball((0.75, 0.9, 0.65), (0.1, 0, 1.65)), box((0.5, 1.3, 0.7), (-0.5, 0, 1.5)))
    nozzle = cone((0, 0, 0.5), (0, 0, 0.1), 0.15, 0.4)
    dish = lathe([(0, 0), (0.2, 0.03), (0.35, 0.12), (0.35, 0.14), (0, 0.02)])
    aerial = rod((-0.4, 0.4, 2.0), (-0.4, 0.6, 2.5), 0.03)
    return join(
        *legs, base, cabin, nozzle, aerial, dish.moved(by=(-0.4, 0.6, 2.5), turn=(30, 0, 0))
    )


def rover() -> Solid:
    """A rover: six wheels on rockers, a flat deck, a mast with a head."""
    wheels = [_wheel((x, 0.55, 0.18), 0.18, 0.2) for x in (-0.75, 0.0, 0.75)]
    rocker = limb([(-0.75, 0.5, 0.2), (-0.35, 0.5, 0.5), (0.15, 0.5, 0.5)], [0.03, 0.035, 0.035])
    front = limb([(-0.35, 0.5, 0.5), (0.0, 0.5, 0.2)], [0.03, 0.03])
    other = limb([(0.15, 0.5, 0.5), (0.75, 0.5, 0.2)], [0.03, 0.03])
    deck = plate([(-0.8, -0.45), (0.6, -0.6), (0.6, 0.6), (-0.8, 0.45)], 0.05)
    mast = join(
        rod((0.5, 0.25, 0.7), (0.5, 0.25, 1.4), 0.035), box((0.12, 0.35, 0.16), (0.5, 0.25, 1.45))
    )
    tail = rod((-0.6, -0.2, 0.7), (-0.9, -0.2, 1.1), 0.08)
    body = box((1.1, 0.7, 0.35), (-0.05, 0, 0.5))
    return join(
        mirrored(join(*wheels, rocker, front, other)), body, deck.moved(by=(0, 0, 0.7)), mast, tail
    )


def tower_crane() -> Solid:
    """A tower crane: a mast, a long jib and a short one with a weight, a hook on a rope."""
    bars = [box((0.05, 0.05, 5.0), (x, y, 2.5)) for x in (-0.15, 0.15) for y in (-0.15, 0.15)]
    ties = [box((0.34, 0.34, 0.05), (0, 0, 0.25 + 0.5 * k)) for k in range(10)]
    jib = join(
        box((4.6, 0.06, 0.06), (1.2, 0.13, 5.0)),
        box((4.6, 0.06, 0.06), (1.2, -0.13, 5.0)),
        box((3.6, 0.06, 0.06), (1.7, 0, 5.3)),
    )
    head = join(rod((0, 0, 5.0), (0, 0, 6.0), 0.05), rod((0, 0, 6.0), (2.4, 0, 5.3), 0.03))
    stay = rod((0, 0, 6.0), (-1.0, 0, 5.0), 0.03)
    load = join(rod((2.6, 0, 5.0), (2.6, 0, 3.7), 0.02), box((0.4, 0.4, 0.3), (2.6, 0, 3.5)))
    weight = box((0.6, 0.5, 0.6), (-0.9, 0, 4.85))
    return join(*bars, *ties, jib, head, stay, load, weight, box((1.2, 1.2, 0.2), (0, 0, 0.0)))


def helicopter() -> Solid:
    """A helicopter: a cabin, a tail with a rotor, four blades, skids."""
    blades = [
        box((1.9, 0.14, 0.03), (0.95, 0, 0)).moved(turn=(0, 0, 25 + 90 * k)) for k in range(4)
    ]
    rotor = join(*blades).moved(by=(0, 0, 1.25))
    tail = limb([(-0.5, 0, 0.6), (-2.4, 0, 0.8)], [0.25, 0.09])
    fin = plate([(-2.2, 0.7), (-2.5, 0.7), (-2.75, 1.3), (-2.55, 1.3)][::-1], 0.05).moved(
        turn=(90, 0, 0)
    )
    small = box((0.08, 0.03, 0.8), (-2.45, 0.12, 0.85)).moved()
    strut = rod((0.3, 0.25, 0.2), (0.3, 0.5, -0.2), 0.03)
    skid = rod((-0.7, 0.5, -0.2), (0.9, 0.5, -0.2), 0.04)
    skids = mirrored(join(strut, strut.moved(by=(-0.6, 0, 0)), skid))
    cabin = join(ball((0.95, 0.55, 0.55), (0.1, 0, 0.5)), box((0.8, 0.5, 0.3), (-0.2, 0, 0.95)))
    return join(cabin, rotor, cone((0, 0, 0.9), (0, 0, 1.3), 0.07), tail, fin, small, skids)


def rocket() -> Solid:
    """A launcher: a core with a fairing, two boosters, nozzles, fins."""
    core = lathe([(0, 0), (0.35, 0), (0.35, 3.2), (0.45, 3.4), (0.45, 4.1), (0.2, 4.7), (0, 4.8)])
    booster = lathe([(0, -0.1), (0.2, -0.1), (0.2, 1.9), (0.05, 2.4), (0, 2.4)])
    nozzle = cone((0, 0, 0), (0, 0, -0.35), 0.12, 0.27)
    fin = plate([(0.3, 0), (0.85, -0.2), (0.85, 0.1), (0.3, 0.7)], 0.04).moved(turn=(90, 0, 0))
    fins = [fin.moved(turn=(0, 0, a)) for a in (90, 270)]
    side = join(booster, nozzle.moved(by=(0, 0, -0.1), scale=0.7)).moved(by=(0.57, 0, 0))
    return join(core, nozzle, mirrored(side, axis=0), *fins)


def relay_satellite() -> Solid:
    """A satellite with two long wings of three panels, two dishes to its sides, horns on top."""
    panels = [box((0.9, 0.03, 0.75), (1.35 + 0.95 * k, 0, 0)) for k in range(3)]
    wing = join(*panels, rod((0.4, 0, 0), (3.7, 0, 0), 0.025))
    dish = lathe([(0, 0), (0.3, 0.05), (0.55, 0.18), (0.55, 0.2), (0, 0.03)])
    mounted = dish.moved(turn=(-70, 0, 0), by=(0, 0.6, 0.25))
    horns = [cone((x, 0, 0.6), (x, 0, 0.95), 0.05, 0.12) for x in (-0.2, 0.2)]
    return join(mirrored(wing, axis=0), mirrored(mounted), box((0.75, 0.8, 1.2)), *horns)


def gripper() -> Solid:
    """A parallel gripper on a flange: two jaws of unlike opening, a palm, cables."""
    jaw = join(box((0.06, 0.12, 0.28), (0.1, 0, 0.36)), box((0.09, 0.1, 0.05), (0.07, 0, 0.48)))
    other = jaw.moved(scale=(-1.4, 1, 1))
    palm = join(box((0.36, 0.16, 0.1), (0, 0, 0.2)), cone((0, 0, 0), (0, 0, 0.16), 0.08, 0.1))
    cable = limb([(0.06, 0.08, 0.2), (0.2, 0.14, 0.1), (0.12, 0.1, -0.05)], [0.012] * 3)
    return join(jaw, other, palm, lathe([(0, 0), (0.13, 0), (0.13, 0.03), (0, 0.03)]), cable)


def robot() -> Solid:
    """A six-axis industrial robot with a bent arm, a weight at its back and a tool."""
    foot = lathe([(0, 0), (0.4, 0), (0.35, 0.12), (0.25, 0.2), (0.22, 0.5), (0, 0.5)])
    shoulder = join(_wheel((0.1, 0, 0.65), 0.2, 0.5), box((0.35, 0.3, 0.4), (-0.2, 0, 0.62)))
    upper = limb([(0.1, 0.05, 0.65), (0.35, 0.05, 1.5)], [0.13, 0.1])
    elbow = join(_wheel((0.35, 0, 1.5), 0.15, 0.4), box((0.35, 0.22, 0.22), (0.15, 0, 1.62)))
    lower = limb([(0.35, 0, 1.6), (1.2, 0, 1.45)], [0.11, 0.07])
    tool = limb([(1.2, 0, 1.45), (1.35, 0, 1.2), (1.35, 0, 1.0)], [0.07, 0.05, 0.03])
    return join(foot, shoulder, upper, elbow, lower, tool, box((0.16, 0.04, 0.05), (1.35, 0, 0.98)))


def bicycle() -> Solid:
    """A bicycle: two wheels with spokes, a frame, handlebars, a saddle."""
    rear, front, crank = (-0.5, 0.0, 0.34), (0.55, 0.0, 0.34), (-0.05, 0.0, 0.3)
    seat, head = (-0.2, 0.0, 0.8), (0.4, 0.0, 0.8)
    pairs = [(rear, crank), (rear, seat), (crank, seat), (crank, head), (seat, head), (head, front)]
    tubes = [rod(a, b, 0.02) for a, b in pairs]
    bars = mirrored(limb([(0.38, 0, 0.95), (0.4, 0.25, 0.97), (0.3, 0.3, 0.95)], [0.016] * 3))
    saddle = join(rod(seat, (-0.23, 0, 0.95), 0.016), ball((0.13, 0.07, 0.03), (-0.23, 0, 0.96)))
    pedals = [rod(crank, (-0.05 + x, 0.1 * s, 0.3), 0.015) for x, s in ((0.16, 1), (-0.16, -1))]
    stem = rod(head, (0.38, 0, 0.95), 0.018)
    return join(_spoked(rear), _spoked(front), *tubes, bars, saddle, *pedals, stem)


def turbine() -> Solid:
    """A wind turbine: a tapering tower, a nacelle, three twisted blades."""
    blade = plate([(-0.07, 0.1), (0.1, 0.35), (0.05, 1.9), (0.0, 1.9), (-0.05, 0.3)][::-1], 0.03)
    upright = blade.moved(turn=(90, 0, 0)).moved(turn=(0, 0, 70))
    blades = [upright.moved(turn=(0, 0, 0)).moved(turn=(20 + 120 * k, 0, 0)) for k in range(3)]
    rotor = join(*blades, ball((0.16, 0.12, 0.12))).moved(by=(0.4, 0, 3.0))
    nacelle = join(box((0.7, 0.24, 0.24), (0, 0, 3.0)), ball((0.15, 0.12, 0.12), (-0.35, 0, 3.0)))
    return join(cone((0, 0, 0), (0, 0, 3.0), 0.16, 0.08), nacelle, rotor)


def _wheel(middle: Point, radius: float, width: float) -> Solid:
    """A wheel whose axle lies along y."""
    x, y, z = middle
    return cone((x, y - width / 2, z), (x, y + width / 2, z), radius)


def _spoked(middle: Point, radius: float = 0.33) -> Solid:
    """A thin wheel with spokes in the plane of x and z."""
    x, y, z = middle
    rim = [(x + radius * cos(k * pi / 12), y, z + radius * sin(k * pi / 12)) for k in range(25)]
    spokes = [rod(middle, rim[k], 0.006) for k in range(0, 24, 3)]
    return join(limb(rim, [0.02] * len(rim)), *spokes, rod((x, -0.05, z), (x, 0.05, z), 0.03))


MACHINES: dict[str, Callable[[], Solid]] = {
    build.__name__: build
    for build in (
        excavator,
        forklift,
        quadcopter,
        lander,
        rover,
        tower_crane,
        helicopter,
        rocket,
        relay_satellite,
        gripper,
        robot,
        bicycle,
        turbine,
    )
}
"""The machines by name."""
