"""Salient motion: whether a track goes somewhere, or only stirs where it is.

Leaves, water and the errors of a background that is no plane move at every moment and get nowhere:
over a longer baseline the background explains them again. Objects leave their place, and keep a
course while they do. (Wixson, Detecting salient motion by accumulating directionally-consistent
flow, 2000.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from visup.percepts.motion.layers import Doubles
from visup.percepts.motion.scene import Measured, Scene
from visup.percepts.motion.tracking import Indices, Track

LEAST_GONE = 1.0  # pixels against the background: less is told of leaves as well
FAR_GONE = 4.0  # pixels, for a track too young to have swung back yet
SWING_S = 0.4
STRAIGHT = 0.7  # net way as a share of the way
EXPLAINED = 0.35  # share of points that fit the background over the baseline that tells most
FITS = 9.0  # squared Mahalanobis distance within which the background explains a point
FOLLOW = 0.3  # weight of the newest frame in running means
FEWEST = 4
MOST_BORDER = 0.2  # share of the image border that an object may take up when it is first told


def weigh(tracks: Sequence[Track], scene: Scene, winner: Indices) -> tuple[Track, ...]:
    """Add up how far each track has gone against the background, and how well that explains it.

    Args:
        tracks: K tracks, updated.
        scene: The frame.
        winner: (count,) the label that has each superpixel; label k is track k - 1.

    Returns:
        The tracks.
    """
    out = []
    for k, t in enumerate(tracks, 1):
        explained = dict(t.explained)
        for m in scene.measured:
            mine = winner[scene.cell_of(m.constraints.xy)] == k
            if np.count_nonzero(mine) >= FEWEST:
                share = float(np.mean(m.background.distances(m.constraints)[mine] < FITS))
                before = explained.get(m.constraints.lag, share)
                explained[m.constraints.lag] = before + FOLLOW * (share - before)
        step = _step(t, scene.measured[0], scene.seconds)
        out.append(
            replace(
                t,
                explained=MappingProxyType(explained),
                gone=(t.gone[0] + float(step[0]), t.gone[1] + float(step[1])),
                way=t.way + float(np.hypot(*step)),
            )
        )
    return tuple(out)


def is_salient(t: Track, scene: Scene) -> bool:
    """Whether a track has left its place, on a course, over some baseline clearly.

    What takes up much of the image border is not surrounded by a ground, it is one: a near wall,
    the rocks in front.
    """
    labels = scene.cells.labels
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    if np.mean(t.share[border] > 0.5) > MOST_BORDER:
        return False
    gone = float(np.hypot(*t.gone))
    clear = min(t.explained.values(), default=0.0) < EXPLAINED
    least = LEAST_GONE if scene.time - t.born >= SWING_S else FAR_GONE
    return clear and gone >= max(least, STRAIGHT * t.way)


def _step(t: Track, m: Measured, seconds: float) -> Doubles:
    """(x, y) pixels that a track moved in a frame against the background nearest to its motion."""
    own = t.brisk() * seconds
    at = np.asarray([t.centre], dtype=np.float32)
    ways = [own - b.at(at)[0] for b in m.background.models]
    return min(ways, key=lambda way: float(np.hypot(*way)))
