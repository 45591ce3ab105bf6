"""Percepts dropped at random, masks that jitter: the same events as without."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Region

TOLD = ("entry", "exit", "occlusion", "reappearance", "coupled", "decoupled", "lost", "found")
Scene = Callable[[int, np.random.Generator], list[Region | None]]


def story(
    scene: Scene, frames: int, seed: int, dropped: float
) -> list[tuple[str, tuple[int, ...]]]:
    """Kinds and objects of all events; regions are dropped singly, never three in a row."""
    rng = np.random.default_rng(seed)
    gone: dict[int, int] = {}
    observations = []
    for i in range(frames):
        kept = []
        for region in scene(i, rng if dropped else np.random.default_rng(0)):
            if region is None:
                continue
            missing = rng.random() < dropped and gone.get(region.id, 0) < 3
            gone[region.id] = gone.get(region.id, 0) + 1 if missing else 0
            kept += [] if missing else [region]
        observations.append(seen(i, kept))
    thoughts = reason(observations)
    return sorted((e.kind, e.objects) for t in thoughts for e in t.events if e.kind in TOLD)


def jitter(rng: np.random.Generator, *rect: float) -> tuple[float, float, float, float]:
    x, y, w, h = (v + float(d) for v, d in zip(rect, rng.normal(0, 0.7, 4), strict=True))
    return x, y, w, h


def coming_and_going(i: int, rng: np.random.Generator) -> list[Region | None]:
    """One stays; another comes over the left border and leaves over the lower one."""
    stays = box_region(1, jitter(rng, 400, 120, 90, 70))
    x, y = min(-60 + 4 * (i - 40), 200), 300 + max(0, 4 * (i - 120))
    comes = box_region(2, jitter(rng, x, y, 60, 60)) if i >= 40 and y < 480 else None
    return [stays, comes]


def being_hidden(i: int, rng: np.random.Generator) -> list[Region | None]:
    """A large box passes before one that stands still."""
    left = -220 + 6 * (i - 25)
    large = box_region(2, jitter(rng, left, 100, 200, 200)) if i >= 25 else None
    x0, x1 = max(200, left + 200 if left <= 200 else 200), min(300, left if left > 200 else 300)
    if i >= 25 and left <= 200 and left + 200 >= 300:
        return [large, None]
    return [box_region(1, jitter(rng, x0, 150, x1 - x0, 80)) if x1 - x0 > 2 else None, large]


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 0.3))
def test_flicker_and_jitter_change_no_event_of_coming_and_going(seed: int, dropped: float) -> None:
    plain = story(coming_and_going, 190, 0, 0.0)
    assert plain == [("entry", (1,)), ("entry", (2,)), ("exit", (2,))]
    assert story(coming_and_going, 190, seed, dropped) == plain


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.05, 0.3))
def test_flicker_and_jitter_change_no_event_of_being_hidden(seed: int, dropped: float) -> None:
    plain = story(being_hidden, 200, 0, 0.0)
    assert [k for k, _ in plain] == ["entry", "entry", "exit", "occlusion", "reappearance"]
    noisy = story(being_hidden, 200, seed, dropped)
    assert [k for k, _ in noisy] == [k for k, _ in plain]
