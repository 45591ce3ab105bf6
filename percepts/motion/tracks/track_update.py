"""Update of tracks from the posterior of a frame: position, velocity, occlusion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.layers.dense_labelling import Labelling
from visup.percepts.motion.tracks.track import Track

FOLLOW_S = 1.0  # time over which the unoccluded velocity follows the measured one, seconds


def update_track(
    track: Track, label: int, labelling: Labelling, cells: Superpixels, now: float, least: float
) -> Track:
    """Update a track from the posterior.

    Args:
        track: The predicted track.
        label: Its label.
        labelling: Labels of the superpixels.
        cells: The superpixels.
        now: Seconds.
        least: Least visible area to count as observed, working pixels.

    Returns:
        The track; cells taken by others become occluded, background cells are dropped.
    """
    mine = labelling.winner == label
    taken = (labelling.winner > 0) & ~mine
    share = labelling.posterior[:, label]
    area = float(cells.area[mine].sum())
    seen = area >= least
    centre = _centroid(cells, mine, area) if seen else track.centre
    occluded, lost = _occluded(track, taken, area, cells, least)
    recent = share if track.recent_share is None else np.maximum(track.recent_share, share)
    return replace(
        track,
        share=share,
        recent_share=recent,
        occluded=occluded,
        core=mine & (labelling.posterior[:, 0] < 0.5),
        last_seen=now if seen else track.last_seen,
        frames=track.frames + int(seen),
        centre=track.centre if track.mostly_occluded else centre,
        mostly_occluded=bool(lost > 0.5 * area),
        unoccluded_velocity=_unoccluded_velocity(track, centre, now)
        if seen
        else track.unoccluded_velocity,
    )


def _centroid(cells: Superpixels, mine: NDArray[np.bool_], area: float) -> tuple[float, float]:
    """(x, y) of some cells, working pixels."""
    where = (cells.centre[mine] * cells.area[mine, None]).sum(axis=0) / area
    return float(where[0]), float(where[1])


def _unoccluded_velocity(
    track: Track, centre: tuple[float, float], now: float
) -> tuple[float, float]:
    """(vx, vy) of a visible track, pixels per second; the last known one while it is hidden."""
    rate = track.best_rate()
    if track.mostly_occluded or rate is None:
        return track.unoccluded_velocity
    # Slowly, so that a beginning occlusion is not taken for the object's own motion.
    follow = 1.0 if track.frames < 15 else min(1.0, (now - track.last_seen) / FOLLOW_S)
    velocity = np.asarray(track.unoccluded_velocity) * (1 - follow) + rate.velocity(centre) * follow
    return float(velocity[0]), float(velocity[1])


def _occluded(
    track: Track, taken: NDArray[np.bool_], area: float, cells: Superpixels, least: float
) -> tuple[NDArray[np.bool_] | None, float]:
    """(h, w) bool, where others hide a track, or None; and the hidden area, pixels.

    Args:
        track: The predicted track.
        taken: (count,) bool, cells owned by others.
        area: Its visible area, working pixels.
        cells: The superpixels.
        least: Least visible area to count as observed, working pixels.
    """
    own = track.predicted_share
    covered = taken & (own > 0.5 if own is not None else False)
    lost = cells.area[covered].sum()
    # A cell or two beside another object is no occlusion; candidates are not remembered.
    if track.id <= 0 or lost <= max(0.05 * area, 0.3 * least):
        return None, lost
    if track.predicted_map is not None and own is not None:
        # By pixels: cells change in each frame, and its edges would wear away.
        return track.predicted_map & cells.paint(taken & (own > 0)), lost
    return cells.paint(covered), lost
