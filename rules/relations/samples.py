"""Samples of all objects over the last second or two, as arrays for fits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import CameraMotion, Mind, ObjectBelief, Observation, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.outlines import write_support
from visup.rules.geometry.regions import DIRECTIONS, FAN, Floats, hull_separation
from visup.rules.presence.object_tracks import merged_pairs, presence_memory
from visup.rules.relations._kinematics_jit import steady_separation

ROOM = 64
"""Number of further samples for which memory is allocated."""

IMAGE_LAG_S = 0.24
"""Time over which the image motion of regions is measured, seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class SampleWindow:
    """The last samples of all objects for relations.

    Consecutive windows share memory, which is written only beyond the end of all existing windows, so that
    many minds cost little more memory than one.

    Attributes:
        ids: (M,) object ids, ascending.
        times: (T,) seconds, ascending, all within the window.
        support: (T, M, 16) pixels; NaN where an object was not seen.
        free: (T, M, 16) bool: clear of the image border.
        separation: (T, M, M) signed hull distances, pixels.
        depth: (T, M) in the objects' units; NaN where unknown.
        drift: (T, M, 2) accumulated image motion of the static scene at each object due to the camera,
            pixels, since the first sample.
        image: (T, M, 3) image motion of each region relative to the static scene, pixels per second, and
            its standard deviation; NaN where unknown.
        start: Row of the shared memory at which the arrays start.
    """

    ids: tuple[int, ...] = ()
    times: Floats = field(default_factory=lambda: np.zeros(0))
    support: Floats = field(default_factory=lambda: np.zeros((0, 0, FAN)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0, FAN), dtype=bool))
    separation: Floats = field(default_factory=lambda: np.zeros((0, 0, 0)))
    depth: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    drift: Floats = field(default_factory=lambda: np.zeros((0, 0, 2)))
    image: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))
    start: int = 0

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """Times and samples."""
        return (
            self.times,
            self.support,
            self.free,
            self.separation,
            self.depth,
            self.drift,
            self.image,
        )

    @property
    def steady_support(self) -> Floats:
        """(T, M, 16) pixels: support of the outlines relative to the static scene, not the picture."""
        if not self.drift.any():
            return self.support
        steady: Floats = self.support - self.drift @ DIRECTIONS.T
        return steady

    @property
    def steady_separation(self) -> Floats:
        """(T, M, M) pixels: distances of the hulls as if the camera had always been as it is now."""
        if not self.drift.any():
            return self.separation
        found: Floats = steady_separation(self.separation, self.support[-1], self.drift, DIRECTIONS)
        return found


def sampled(
    history: SampleWindow,
    objects: tuple[ObjectBelief, ...],
    mind: Mind,
    observation: Observation,
    drift: Floats,
    limits: tuple[float, int],
) -> SampleWindow:
    """Add this step's sample, and drop those that are too old.

    Args:
        history: The samples before.
        objects: The objects that are present now, by id.
        mind: The mind.
        observation: The observation, which records whether regions were searched for.
        drift: (M, 2) pixels; see `SampleWindow`.
        limits: Length of the window, seconds; most samples in it: a sample that comes too soon is
            skipped.

    Returns:
        The samples of these objects; NaN for those not seen now.
    """
    ids, (window_s, most) = tuple(b.id for b in objects), limits
    history = reindexed(history, ids)
    old = int(history.times.searchsorted(mind.time - window_s - 1e-6, side="right"))
    least = window_s / most
    due = len(history.times) == 0 or mind.time - history.times[-1] >= least - 1e-6
    if not (due and observation.observed("region")):
        return without_oldest(history, old)
    joint = {i for pair in merged_pairs(mind) for i in pair}
    support = np.full((len(ids), FAN), np.nan)
    free = np.zeros((len(ids), FAN), dtype=bool)
    depth, image = np.full(len(ids), np.nan), np.full((len(ids), 3), np.nan)
    panning = _camera_velocity(history, mind.time, drift)
    for i, b in enumerate(objects):
        if b.last_seen == mind.time and b.presence is Presence.SEEN and b.id not in joint:
            write_support(b.region, mind.frame_size, support[i], free[i])
            depth[i] = np.nan if b.depth is None else b.depth
            if b.region.velocity_sigma > 0.0:
                image[i] = (*(b.region.velocity - panning[i]), b.region.velocity_sigma)
    row = (mind.time, support, free, hull_separation(support), depth, drift, image)
    return extended(without_reassigned(history, mind), row, old)


def _camera_velocity(history: SampleWindow, now: float, drift: Floats) -> Floats:
    """(M, 2) image motion of the static scene at each object over the time for which regions' lags, px/s."""
    since = int(history.times.searchsorted(now - IMAGE_LAG_S - 1e-6))
    if since >= len(history.times):
        return np.zeros_like(drift)
    panning: Floats = (drift - history.drift[since]) / (now - history.times[since])
    return panning


def camera_motion(observation: Observation) -> CameraMotion | None:
    """The image motion of the static scene since the previous frame; None if it rests or is unknown."""
    motions: Sequence[CameraMotion] = observation.of("camera")
    return motions[-1] if motions and not np.array_equal(motions[-1].motion, np.eye(2, 3)) else None


def drifted(before: Floats, objects: Sequence[ObjectBelief], observation: Observation) -> Floats:
    """Accumulate the image motion due to the camera at each object by one frame.

    The static scene moves in the picture of a camera that pans, shakes or zooms. The motion is taken at
    the centre of an object, so that for a zoom or a rotation only the shift is compensated, not the growth.
    Without an estimate the camera is assumed at rest.

    Args:
        before: (M, 2) pixels, up to the previous frame.
        objects: The M objects.
        observation: The observation; of several camera motions the last counts.

    Returns:
        (M, 2) pixels; the same array if the camera rests.
    """
    camera = camera_motion(observation)
    if camera is None:
        return before
    moved = [camera.displacement(b.region.centroid) for b in objects]
    drift: Floats = before + np.array(moved).reshape(-1, 2)
    return drift


def covers_window(history: SampleWindow, window_s: float) -> bool:
    """Whether enough of the window is filled for a fit: six samples over three fifths of it."""
    times = history.times
    return len(times) >= 6 and bool(times[-1] - times[0] >= 0.6 * window_s)


def reindexed(history: SampleWindow, ids: tuple[int, ...]) -> SampleWindow:
    """A history re-indexed for other objects; new ones have no samples."""
    if ids == history.ids:
        return history
    t, m = len(history.times), len(ids)
    support, free = np.full((t, m, FAN), np.nan), np.zeros((t, m, FAN), dtype=bool)
    separation, depth = np.full((t, m, m), np.nan), np.full((t, m), np.nan)
    drift, image = np.zeros((t, m, 2)), np.full((t, m, 3), np.nan)
    new = [i for i, x in enumerate(ids) if x in history.ids]
    old = [history.ids.index(ids[i]) for i in new]
    support[:, new], free[:, new] = history.support[:, old], history.free[:, old]
    depth[:, new], drift[:, new] = history.depth[:, old], history.drift[:, old]
    image[:, new] = history.image[:, old]
    separation[np.ix_(range(t), new, new)] = history.separation[np.ix_(range(t), old, old)]
    return SampleWindow(ids, history.times, support, free, separation, depth, drift, image)


def without_reassigned(history: SampleWindow, mind: Mind) -> SampleWindow:
    """A history without the samples of objects from before they were given another region."""
    of = presence_memory(mind).tracks
    changed = np.array([of[i].changed_at if i in of else -1.0 for i in history.ids])
    if not len(history.times) or not (changed > history.times[0] + 1e-9).any():
        return history
    old = history.times[:, None] < changed[None, :] - 1e-9
    # Unchanged if they were removed before.
    if not (old[:, :, None] & (history.support == history.support)).any():
        return history
    either = old[:, :, None] | old[:, None, :]
    return replace(
        history,
        support=np.where(old[:, :, None], np.nan, history.support),
        separation=np.where(either, np.nan, history.separation),
        image=np.where(old[:, :, None], np.nan, history.image),
    )


def without_oldest(history: SampleWindow, old: int) -> SampleWindow:
    """A history without its `old` oldest samples."""
    if not old:
        return history
    left = (a[old:] for a in history.arrays)
    return _window(history.ids, left, history.start + old)


def extended(history: SampleWindow, row: tuple[Any, ...], old: int = 0) -> SampleWindow:
    """A history with one more sample, a row of each array, and without old ones."""
    count = len(history.times)
    end = history.start + count
    memory: list[Any] = [a.base for a in history.arrays]
    # A row without a time is unused; foreign arrays have no room at all.
    if any(m is None or len(m) <= end for m in memory) or memory[0][end] == memory[0][end]:
        history = _with_room(without_oldest(history, old), max(ROOM, count))
        count, old = count - old, 0
        end = count
        memory = [a.base for a in history.arrays]
    for values, new in zip(memory, row, strict=True):
        values[end] = new
    start = history.start + old
    return _window(history.ids, (m[start : end + 1] for m in memory), start)


def _with_room(history: SampleWindow, more: int) -> SampleWindow:
    """Copy the history to new memory with room for more samples."""
    count = len(history.times)

    def roomy(values: NDArray[Any]) -> NDArray[Any]:
        blank = False if values.dtype == np.bool_ else np.nan
        wide = np.full((count + more, *values.shape[1:]), blank, dtype=values.dtype)
        wide[:count] = values
        return wide[:count]

    return _window(history.ids, map(roomy, history.arrays))


def _window(ids: tuple[int, ...], arrays: Iterable[NDArray[Any]], start: int = 0) -> SampleWindow:
    """The samples of some objects, from arrays in the order of `SampleWindow.arrays`."""
    times, support, free, separation, depth, drift, image = arrays
    return SampleWindow(ids, times, support, free, separation, depth, drift, image, start)
