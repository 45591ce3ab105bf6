"""Four-legged animals from ellipsoids and limbs: nose along x, back up along z, about a metre long."""

from __future__ import annotations

from collections.abc import Callable

from visup.render.meshes.solids import Colour, Solid, ball, cone, join, limb, mirrored

BROWN: Colour = (0.45, 0.32, 0.20)
SAND: Colour = (0.70, 0.58, 0.40)
PINK: Colour = (0.80, 0.58, 0.55)
DUN: Colour = (0.36, 0.25, 0.17)

Point = tuple[float, float, float]


def legs(
    front: float, back: float, half_spacing: float, top: float, radius: float, colour: Colour
) -> Solid:
    """Two pairs of legs down to the ground.

    Args:
        front: x of the front pair.
        back: x of the back pair.
        half_spacing: Distance of a leg from the middle plane.
        top: Height at which they start.
        radius: At the top; they taper to three fifths.
        colour: Reflectance.

    Returns:
        Four legs with feet.
    """
    fore = limb(
        [
            (front, half_spacing, top),
            (front + 0.02, half_spacing, top * 0.45),
            (front, half_spacing, 0.03),
        ],
        [radius * 1.1, radius * 0.7, radius * 0.6],
        colour,
    )
    hind = limb(
        [
            (back, half_spacing, top),
            (back - 0.06, half_spacing, top * 0.48),
            (back, half_spacing, 0.03),
        ],
        [radius * 1.4, radius * 0.75, radius * 0.6],
        colour,
    )
    feet = [
        ball((radius, radius * 0.7, 0.03), (x + radius * 0.4, half_spacing, 0.03), colour)
        for x in (front, back)
    ]
    return mirrored(join(fore, hind, *feet))


def ears(base: Point, tip: Point, radius: float, colour: Colour) -> Solid:
    """A pair of pointed ears."""
    return mirrored(cone(base, tip, radius, 0.1 * radius, colour))


def dog() -> Solid:
    """A dog with a raised tail and a muzzle."""
    return join(
        limb([(-0.3, 0, 0.5), (0.05, 0, 0.48), (0.32, 0, 0.54)], [0.13, 0.13, 0.16], BROWN),
        limb([(0.38, 0, 0.6), (0.5, 0, 0.8)], [0.11, 0.09], BROWN),
        limb([(0.5, 0, 0.82), (0.6, 0, 0.8), (0.74, 0, 0.76)], [0.12, 0.09, 0.055], BROWN),
        ears((0.46, 0.09, 0.9), (0.40, 0.13, 1.04), 0.06, BROWN),
        limb([(-0.4, 0, 0.55), (-0.55, 0, 0.68), (-0.62, 0, 0.86)], [0.05, 0.04, 0.02], BROWN),
        legs(0.32, -0.32, 0.11, 0.45, 0.075, BROWN),
    )


def horse() -> Solid:
    """A horse with a long neck, a mane and a hanging tail."""
    return join(
        limb([(-0.38, 0, 0.88), (0.0, 0, 0.84), (0.36, 0, 0.88)], [0.2, 0.19, 0.19], DUN),
        limb([(0.42, 0, 0.95), (0.62, 0, 1.2), (0.7, 0, 1.36)], [0.17, 0.11, 0.09], DUN),
        limb([(0.7, 0, 1.38), (0.82, 0, 1.28), (0.98, 0, 1.12)], [0.1, 0.085, 0.06], DUN),
        ears((0.66, 0.06, 1.44), (0.64, 0.08, 1.56), 0.035, DUN),
        limb([(-0.55, 0, 0.98), (-0.7, 0, 0.85), (-0.74, 0, 0.45)], [0.04, 0.07, 0.03], DUN),
        legs(0.36, -0.42, 0.14, 0.78, 0.085, DUN),
    )


def camel() -> Solid:
    """A camel with two humps and a curved neck."""
    return join(
        limb([(-0.36, 0, 0.92), (0.0, 0, 0.9), (0.34, 0, 0.94)], [0.18, 0.21, 0.19], SAND),
        ball((0.16, 0.13, 0.24), (-0.2, 0, 1.1), SAND),
        ball((0.16, 0.13, 0.24), (0.2, 0, 1.12), SAND),
        limb(
            [(0.42, 0, 0.92), (0.66, 0, 0.82), (0.8, 0, 1.0), (0.84, 0, 1.32)],
            [0.14, 0.1, 0.085, 0.075],
            SAND,
        ),
        limb([(0.82, 0, 1.36), (0.94, 0, 1.36), (1.06, 0, 1.3)], [0.09, 0.075, 0.06], SAND),
        ears((0.78, 0.06, 1.42), (0.74, 0.09, 1.5), 0.03, SAND),
        limb([(-0.52, 0, 0.98), (-0.6, 0, 0.72)], [0.03, 0.025], SAND),
        legs(0.34, -0.36, 0.13, 0.85, 0.07, SAND),
    )


def pig() -> Solid:
    """A pig: a barrel on short legs, with a snout and a curl of a tail."""
    return join(
        ball((0.48, 0.27, 0.27), (0, 0, 0.42), PINK),
        limb([(0.42, 0, 0.48), (0.58, 0, 0.46)], [0.2, 0.16], PINK),
        cone((0.6, 0, 0.43), (0.8, 0, 0.4), 0.1, 0.08, PINK),
        ears((0.54, 0.1, 0.6), (0.62, 0.16, 0.72), 0.07, PINK),
        limb([(-0.47, 0, 0.5), (-0.55, 0, 0.56), (-0.53, 0, 0.63)], [0.02, 0.018, 0.015], PINK),
        legs(0.28, -0.3, 0.14, 0.3, 0.08, PINK),
    )


ANIMALS: dict[str, Callable[[], Solid]] = {"dog": dog, "horse": horse, "camel": camel, "pig": pig}
