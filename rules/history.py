"""The last second or two of all objects, as arrays: what lines are fitted to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief, Observation, Presence
from visup.agent.changing import replace
from visup.rules.geometry import FAN, Floats, hull_separation, reach
from visup.rules.tracks import merged_pairs, tracks


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The last samples of all objects that relations are judged of.

    Attributes:
        ids: (M,) object ids, increasing.
        times: (T,) seconds, increasing, all within the window.
        support: (T, M, 16) pixels; NaN where an object was not seen.
        free: (T, M, 16) bool.
        separation: (T, M, M) signed hull distances, pixels.
        depth: (T, M) in the objects' units; NaN where unknown.
    """

    ids: tuple[int, ...] = ()
    times: Floats = field(default_factory=lambda: np.zeros(0))
    support: Floats = field(default_factory=lambda: np.zeros((0, 0, FAN)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0, FAN), dtype=bool))
    separation: Floats = field(default_factory=lambda: np.zeros((0, 0, 0)))
    depth: Floats = field(default_factory=lambda: np.zeros((0, 0)))


def sample(
    history: History,
    objects: tuple[ObjectBelief, ...],
    mind: Mind,
    observation: Observation,
    window_s: float,
    most: int,
) -> History:
    """A history with this step's sample, and without those that are too old.

    Args:
        history: The samples before.
        objects: The objects that are present now, by id.
        mind: The mind.
        observation: Whether anybody looked for regions in this step.
        window_s: How far back samples are kept, seconds.
        most: Most samples in that time; a sample that comes sooner is left out.

    Returns:
        The samples of these objects; NaN for those that are not seen now.
    """
    ids = tuple(b.id for b in objects)
    history = reindexed(history, ids)
    kept = history.times > mind.time - window_s - 1e-6
    least = window_s / most
    due = len(history.times) == 0 or mind.time - history.times[-1] >= least - 1e-6
    if not (due and observation.observed("region")):
        return only(history, kept)
    joint = {i for pair in merged_pairs(mind) for i in pair}
    seen = [
        b.last_seen == mind.time and b.presence is Presence.SEEN and b.id not in joint
        for b in objects
    ]
    reaches = [reach(b.region, mind.frame_size) for b in objects]
    support = np.full((len(ids), FAN), np.nan)
    free = np.zeros((len(ids), FAN), dtype=bool)
    for i, (r, s) in enumerate(zip(reaches, seen, strict=True)):
        if s:
            support[i], free[i] = r.support, r.free
    depth = np.array([np.nan if b.depth is None else b.depth for b in objects])
    history = comparable(only(history, kept), mind)
    return History(
        ids,
        np.append(history.times, mind.time),
        np.concatenate([history.support, support[None]]),
        np.concatenate([history.free, free[None]]),
        np.concatenate([history.separation, hull_separation(support)[None]]),
        np.concatenate([history.depth, np.where(seen, depth, np.nan)[None]]),
    )


def covered(history: History, window_s: float) -> bool:
    """Whether enough of the window is filled for a fit: six samples over three fifths of it."""
    times = history.times
    return len(times) >= 6 and bool(times[-1] - times[0] >= 0.6 * window_s)


def reindexed(history: History, ids: tuple[int, ...]) -> History:
    """A history of other objects: those that are new have no samples, others keep theirs."""
    if ids == history.ids:
        return history
    t, m = len(history.times), len(ids)
    support, free = np.full((t, m, FAN), np.nan), np.zeros((t, m, FAN), dtype=bool)
    separation, depth = np.full((t, m, m), np.nan), np.full((t, m), np.nan)
    new = [i for i, x in enumerate(ids) if x in history.ids]
    old = [history.ids.index(ids[i]) for i in new]
    support[:, new], free[:, new] = history.support[:, old], history.free[:, old]
    depth[:, new] = history.depth[:, old]
    separation[np.ix_(range(t), new, new)] = history.separation[np.ix_(range(t), old, old)]
    return History(ids, history.times, support, free, separation, depth)


def comparable(history: History, mind: Mind) -> History:
    """A history without the samples of objects whose regions have changed their nature since."""
    of = tracks(mind).of
    changed = np.array([of[i].changed_at if i in of else -1.0 for i in history.ids])
    old = history.times[:, None] < changed[None, :] - 1e-9
    if not old.any():
        return history
    either = old[:, :, None] | old[:, None, :]
    return replace(
        history,
        support=np.where(old[:, :, None], np.nan, history.support),
        separation=np.where(either, np.nan, history.separation),
    )


def only(history: History, kept: NDArray[np.bool_]) -> History:
    """The samples of a history for which `kept` is true."""
    if kept.all():
        return history
    return History(
        history.ids,
        history.times[kept],
        history.support[kept],
        history.free[kept],
        history.separation[kept],
        history.depth[kept],
    )
