"""Units and dimensions: sums require equal dimensions, products combine them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Span:
    """Position of a node: lines and columns counted from 1, the end column exclusive.

    Attributes:
        file: The included file it is in; empty for the file itself.
    """

    line: int = 0
    column: int = 0
    end_line: int = 0
    end_column: int = 0
    file: str = ""

    def to(self, last: Span) -> Span:
        """From the start of this span to the end of another."""
        return Span(self.line, self.column, last.end_line, last.end_column)

    @property
    def length(self) -> int:
        """Characters on its line; 1 for a node that spans several lines."""
        return self.end_column - self.column if self.end_line == self.line else 1


NOWHERE = Span()


@dataclass(frozen=True, slots=True)
class Dimension:
    """A physical dimension: powers of length, time and angle; none for a share.

    Attributes:
        length: Power of pixels.
        time: Power of seconds.
        angle: Power of degrees.
        metres: Power of metres; lengths in the scene differ from lengths in the image.
    """

    length: int = 0
    time: int = 0
    angle: int = 0
    metres: int = 0

    def __mul__(self, other: Dimension) -> Dimension:
        """The dimension of a product."""
        return Dimension(*(p + q for p, q in zip(self.powers, other.powers, strict=True)))

    def __truediv__(self, other: Dimension) -> Dimension:
        """The dimension of a quotient."""
        return Dimension(*(p - q for p, q in zip(self.powers, other.powers, strict=True)))

    @property
    def powers(self) -> tuple[int, int, int, int]:
        """Powers of length, time, angle and metres."""
        return self.length, self.time, self.angle, self.metres

    def __str__(self) -> str:
        return DIMENSION_NAMES.get(self) or " ".join(
            f"{unit}^{power}"
            for unit, power in zip(("px", "s", "deg", "m"), self.powers, strict=True)
            if power
        )


SHARE = Dimension()
LENGTH = Dimension(length=1)
TIME = Dimension(time=1)
ANGLE = Dimension(angle=1)
SPEED = LENGTH / TIME
ANGULAR_SPEED = ANGLE / TIME
ACCELERATION = SPEED / TIME
RATE_OF_CHANGE = SHARE / TIME
REAL_LENGTH = Dimension(metres=1)
REAL_SPEED = REAL_LENGTH / TIME

DIMENSION_NAMES = {
    SHARE: "share",
    LENGTH: "length",
    TIME: "time",
    ANGLE: "angle",
    SPEED: "speed",
    ANGULAR_SPEED: "rate of turn",
    ACCELERATION: "acceleration",
    RATE_OF_CHANGE: "rate of change",
    REAL_LENGTH: "real length",
    REAL_SPEED: "real speed",
}
"""Named dimensions, for messages and docs."""


class Unit(StrEnum):
    """Units of numbers."""

    NONE = ""
    MS = "ms"
    S = "s"
    MIN = "min"
    H = "h"
    PX = "px"
    PX_S = "px/s"
    PX_S2 = "px/s2"
    PERCENT = "%"
    DEG = "deg"
    DEG_S = "deg/s"
    PER_S = "/s"
    M = "m"
    CM = "cm"
    MM = "mm"
    M_S = "m/s"


UNITS: dict[str, tuple[Dimension, float]] = {
    Unit.NONE: (SHARE, 1.0),
    Unit.MS: (TIME, 0.001),
    Unit.S: (TIME, 1.0),
    Unit.MIN: (TIME, 60.0),
    Unit.H: (TIME, 3600.0),
    Unit.PX: (LENGTH, 1.0),
    Unit.PX_S: (SPEED, 1.0),
    Unit.PX_S2: (ACCELERATION, 1.0),
    Unit.PERCENT: (SHARE, 0.01),
    Unit.DEG: (ANGLE, 1.0),
    Unit.DEG_S: (ANGULAR_SPEED, 1.0),
    Unit.PER_S: (RATE_OF_CHANGE, 1.0),
    Unit.MM: (REAL_LENGTH, 0.001),
    Unit.CM: (REAL_LENGTH, 0.01),
    Unit.M: (REAL_LENGTH, 1.0),
    Unit.M_S: (REAL_SPEED, 1.0),
}
"""Unit -> dimension, and factor to the base unit."""

TICKS = 1_000_000
"""Ticks per second: times are integer microseconds, so that window bounds compare exactly."""


def ticks(seconds: float) -> int:
    """Seconds as integer microseconds."""
    return round(seconds * TICKS)


def units_of(dimension: Dimension) -> str:
    """The units of a dimension, for messages: 'a speed: px/s'."""
    units = [str(u) or "no unit" for u, (d, _) in UNITS.items() if d == dimension]
    return f"a {dimension}: {', '.join(units)}" if units else f"a quantity in {dimension}"


@dataclass(frozen=True, slots=True)
class Number:
    """`20 s`: a number with its unit.

    Attributes:
        value: The number, in its unit.
        unit: One of `UNITS`; possibly another word in an unchecked task file.
    """

    value: float
    unit: str = Unit.NONE
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    @property
    def base(self) -> float:
        """The number in the base unit of its dimension: seconds, pixels, share of one."""
        return self.value * UNITS[self.unit][1]

    @property
    def dimension(self) -> Dimension:
        """Its dimension."""
        return UNITS[self.unit][0]

    def __str__(self) -> str:
        return f"{number_text(self.value)} {self.unit}".rstrip()


def number_text(number: float) -> str:
    """A number as written by people: integers without a decimal point."""
    if number == float("inf"):
        return "1e999"
    return str(int(number)) if number == int(number) and abs(number) < 1e15 else repr(number)


UNITS_MEANT: Mapping[str, str] = MappingProxyType(
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
"""Common spelling -> the unit meant."""
