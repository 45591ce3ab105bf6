"""Units of amounts in tasks: those of rules, and physical sizes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from visup.rules.formula import units as of_rules
from visup.rules.formula.units import Dimension, Number, Unit

TIME, LENGTH, SPEED, SHARE, ANGLE, ANGULAR_SPEED, SIZE = (
    "time",
    "length",
    "speed",
    "share",
    "angle",
    "angular_speed",
    "size",
)

MEASURES: Mapping[Dimension, str] = MappingProxyType(
    {
        of_rules.TIME: TIME,
        of_rules.LENGTH: LENGTH,
        of_rules.SPEED: SPEED,
        of_rules.SHARE: SHARE,
        of_rules.ANGLE: ANGLE,
        of_rules.ANGULAR_SPEED: ANGULAR_SPEED,
        of_rules.REAL_LENGTH: SIZE,
    }
)
"""Dimension of a quantity in rules -> its name in tasks."""

UNITS = MappingProxyType(
    {
        unit: (MEASURES[measured], factor)
        for unit, (measured, factor) in of_rules.UNITS.items()
        if unit != Unit.NONE and measured in MEASURES
    }
)
"""Unit -> (dimension, factor to the base unit)."""


def value(amount: Number) -> float:
    """An amount in its base unit; an unknown unit counts as the base unit."""
    return amount.value * UNITS.get(amount.unit, ("", 1.0))[1]


def dimension(amount: Number) -> str:
    """The dimension of an amount; empty if its unit is unknown."""
    return UNITS.get(amount.unit, ("", 1.0))[0]


def units_of(measured: str) -> str:
    """The units of a dimension as a phrase: "`ms`, `s`, `min` or `h`"."""
    known = [f"`{u}`" for u, (d, _) in UNITS.items() if d == measured]
    return known[0] if len(known) == 1 else f"{', '.join(known[:-1])} or {known[-1]}"
