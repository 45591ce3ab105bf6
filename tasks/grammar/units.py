"""Units of amounts: what each measures, and how many of the base unit it is."""

from __future__ import annotations

from types import MappingProxyType

from visup.tasks.grammar.conditions import Amount

TIME, LENGTH, SPEED, SHARE, ANGLE, TURN, SIZE = (
    "time",
    "length",
    "speed",
    "share",
    "angle",
    "angular_speed",
    "size",
)

UNITS = MappingProxyType(
    {
        "ms": (TIME, 0.001),
        "s": (TIME, 1.0),
        "min": (TIME, 60.0),
        "h": (TIME, 3600.0),
        "px": (LENGTH, 1.0),
        "px/s": (SPEED, 1.0),
        "%": (SHARE, 0.01),
        "deg": (ANGLE, 1.0),
        "deg/s": (TURN, 1.0),
        "mm": (SIZE, 0.001),
        "cm": (SIZE, 0.01),
        "m": (SIZE, 1.0),
    }
)
"""Unit -> (what it measures, how many of the base unit one of it is)."""

MEANT = MappingProxyType(
    {
        "sec": "s", "secs": "s", "second": "s", "seconds": "s", "mins": "min", "minute": "min",
        "minutes": "min", "hr": "h", "hrs": "h", "hour": "h", "hours": "h", "msec": "ms",
        "msecs": "ms", "millisecond": "ms", "milliseconds": "ms", "pixel": "px", "pixels": "px",
        "pix": "px", "pixel/s": "px/s", "pixels/s": "px/s", "px/sec": "px/s", "percent": "%",
        "degree": "deg", "degrees": "deg", "degree/s": "deg/s", "degrees/s": "deg/s",
        "deg/sec": "deg/s", "dps": "deg/s", "meter": "m", "meters": "m", "metre": "m",
        "metres": "m",
    }
)  # fmt: skip
"""What people write -> the unit that they mean."""


def value(amount: Amount) -> float:
    """An amount in the base unit of what it measures; an unknown unit counts as the base unit."""
    return amount.number * UNITS.get(amount.unit, ("", 1.0))[1]


def dimension(amount: Amount) -> str:
    """What an amount measures; empty when its unit is unknown."""
    return UNITS.get(amount.unit, ("", 1.0))[0]


def units_of(measured: str) -> str:
    """The units of what is measured, as one says them: "`ms`, `s`, `min` or `h`"."""
    known = [f"`{u}`" for u, (d, _) in UNITS.items() if d == measured]
    return known[0] if len(known) == 1 else f"{', '.join(known[:-1])} or {known[-1]}"
