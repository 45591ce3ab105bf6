"""Scripted minds: boxes that move about each other, for timing rules; no images needed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import reduce
from math import cos, pi, sin

import numpy as np

from visup.agent import Mind, Observation, Percept, Region, Report, ReportState
from visup.rules.formula.nodes import Rule
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.rules.reasoners import default_reasoners

SIZE = (640, 480)
FPS = 25.0
SIDE = 40.0

MORE_RULES = """
rule too_close(a, b): warning
    when gap(a, b) < 30 px leave 40 px and closing_speed(a, b) > 2 px/s for 0.5 s
    say "{a} {is} too close to {b}."
rule fast(a): info when speed(a) > 60 px/s for 0.4 s cooldown 5 s say "{a} moves fast."
rule crowded(a): info
    when exists b: (gap(a, b) < 20 px and exists c: gap(b, c) < 20 px) say "{a} {is} in a crowd."
rule alone(a): info when forall b: gap(a, b) > 200 px for 2 s say "{a} {is} alone."
rule brakes(a): info when rate(speed(a), 1 s) < -20 px/s2 say "{a} slows down."
rule unsteady(a): info when moving(a) in 30 % of 4 s and not moving(a) in 30 % of 4 s say "{a}"
rule flickers(a): info when hidden(a) in 3 of 10 samples say "{a} flickers."
rule turned_away(a, b): info
    when diverging(a, b) since[6 s] converging(a, b) say "{a} turned away from {b}."
rule near_miss(a, b): warning
    when gap(a, b) < 15 px within 3 s and diverging(a, b) for 0.5 s say "{a} just missed {b}."
rule follows(a, b): info
    when moving_together(a, b) and abs(closing_speed(a, b)) < 2 px/s for 2 s say "{a} follows {b}."
rule stays(a): info when not moving(a) for 20 s and in_view(a) > 20 s say "{a} stays."
rule never_stops(a): info when always moving(a) and in_view(a) > 10 s say "{a} never stops."
rule comes_near(a, b): info
    when eventually[1 s] gap(a, b) < 40 px and gap(a, b) > 100 px say "{a} comes near {b}."
"""


def twenty_rules() -> tuple[Rule, ...]:
    """The shipped rules and as many more as make twenty, which use all that the language has."""
    return (*shipped_rules(), *parse_rules(MORE_RULES))


def minds(objects: int, frames: int) -> Iterator[Mind]:
    """Minds of boxes that go round on ellipses, as rules find them."""
    reasoners = default_reasoners(rules=())
    mind = Mind()
    for index in range(frames):
        seen = observation(index, objects)
        mind = replace(mind, time=seen.time, frame_index=index, frame_size=SIZE)
        chain = (*reasoners.update, *reasoners.cogitate)
        mind = reduce(lambda m, reasoner: reasoner(m, seen).mind, chain, mind)
        yield mind


def observation(index: int, objects: int) -> Observation:
    """What is seen of the boxes at one frame."""
    now = index / FPS
    regions = []
    for k in range(objects):
        angle = 2 * pi * (k / objects + now / (20 + 3 * k))
        x = SIZE[0] / 2 + 250 * cos(angle) - SIDE / 2
        y = SIZE[1] / 2 + (100 + 8 * k) * sin(angle) - SIDE / 2
        regions.append(box(k + 1, x, y))
    percepts = tuple(Percept("region", r, now, "script") for r in regions)
    return Observation(
        index, now, SIZE, (Report("script", ReportState.RAN, ("region",), percepts),)
    )


def box(number: int, x: float, y: float) -> Region:
    """An upright box with its upper left corner at (x, y), pixels."""
    left, top, side = round(x), round(y), round(SIDE)
    along = np.linspace(0.0, SIDE - 1, 20)
    ends = np.full(20, SIDE - 1)
    nothing = np.zeros(20)
    across = np.concatenate([along, ends, along[::-1], nothing]) + x
    down = np.concatenate([nothing, along, ends, along[::-1]]) + y
    return Region(
        id=number,
        bbox=(left, top, side, side),
        mask=np.ones((side, side), dtype=bool),
        contour=np.stack([across, down], axis=1).astype(np.float32),
        centroid=(x + SIDE / 2, y + SIDE / 2),
        area=SIDE * SIDE,
        cut=False,
        confidence=0.9,
    )
