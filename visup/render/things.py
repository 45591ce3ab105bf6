"""Seventeen things that are neither satellite nor arm, to be told apart from them by their outline.

All are built from primitives, standing along z, facing x, roughly one unit in size.
"""

from __future__ import annotations

from collections.abc import Callable

from visup.render.shapes import Solid, ball, box

THINGS: dict[str, Callable[[], Solid]] = {"ball": lambda: ball(1.0), "cube": lambda: box((1, 1, 1))}
