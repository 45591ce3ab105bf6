"""Prediction of tracks to the next frame, and the label priors that follow."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from math import inf
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features._superpixels_jit import carry_shares
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.tracks.track import Track, Tracks

T = TypeVar("T", bound=np.generic)
PATH_S = 2.8  # how long the path of a track is remembered, seconds
EVERY = 4  # every how many pixels of a cell are traced back along the flow
FADE = 0.4  # share of `recent_share` that remains after a second


def predict_tracks(
    tracks: Tracks, flow: Floats, old: Superpixels, new: Superpixels, seconds: float
) -> Tracks:
    """Predict tracks in the next frame.

    Visible parts move with the flow. The position predicted by the track's own motion is stored as well: if
    another object appears there, the track is hidden behind it. That map is moved by whole pixels, so that
    repeated small moves do not blur it.

    Args:
        tracks: The tracks as of the previous frame.
        flow: (h, w, 2) float32, from the newest image back to the last.
        old: Superpixels of the previous frame.
        new: Superpixels of the newest frame.
        seconds: Between the two frames.

    Returns:
        The tracks as predicted for the newest image.
    """
    if not tracks:
        return ()
    before = [t.share for t in tracks]
    before += [t.share if t.recent_share is None else t.recent_share for t in tracks]
    shares = np.stack(before, axis=1).astype(np.float32, copy=False)
    found = carry_shares(
        old.labels, new.labels, flow, np.ascontiguousarray(shares), new.area, EVERY
    )
    moved = np.ascontiguousarray(found.T)
    return tuple(
        _predicted(t, share, np.float32(FADE**seconds) * recent, old, new, seconds)
        for t, share, recent in zip(tracks, moved, moved[len(tracks) :], strict=False)
    )


def _predicted(
    track: Track, share: Floats, recent: Floats, old: Superpixels, new: Superpixels, seconds: float
) -> Track:
    """A predicted track, given its share and recent share carried to each superpixel."""
    drift = np.asarray(track.pending_shift) + np.asarray(track.unoccluded_velocity) * seconds
    pixels = np.round(drift)
    rest = drift - pixels
    step_xy = track.instant_velocity() * seconds
    last = track.path[-1] if track.path else (track.initiated, 0.0, 0.0)
    here = (last[0] + seconds, last[1] + float(step_xy[0]), last[2] + float(step_xy[1]))
    path = track.path[bisect_right(track.path, (here[0] - PATH_S, inf)) :]
    by = int(pixels[0]), int(pixels[1])
    # An object fades before an occluder hides it: what it still covers counts.
    body = track.share > 0.5
    if track.core is not None:
        body = body | track.core
    whole = None
    if track.occluded is None:
        own = new.shifted(old, body, by)
    else:
        whole = shift_map(old.paint(body) | track.occluded, *by)
        own = new.mean(whole)
    return replace(
        track,
        share=share,
        recent_share=np.maximum(recent, share),
        occluded=None if track.occluded is None else shift_map(track.occluded, *by),
        predicted_share=own,
        predicted_map=whole,
        core=None,
        path=(*(path or (last,)), here),
        pending_shift=(float(rest[0]), float(rest[1])),
    )


def shift_map(image: NDArray[T], dx: int, dy: int) -> NDArray[T]:
    """An image shifted by whole pixels, filled with zeros."""
    if dx == 0 and dy == 0:
        return image
    out = np.zeros_like(image)
    height, width = image.shape
    top, left, bottom, right = (
        max(dy, 0),
        max(dx, 0),
        min(height + dy, height),
        min(width + dx, width),
    )
    if bottom > top and right > left:
        out[top:bottom, left:right] = image[top - dy : bottom - dy, left - dx : right - dx]
    return out


def label_priors(tracks: Sequence[Track], cells: Superpixels) -> Floats:
    """Label shares expected in the newest image.

    Args:
        tracks: Carried tracks.
        cells: Superpixels of the newest image.

    Returns:
        (count, K + 2) float32: background, each track, and unknown motion (zero).
    """
    # Label by label: NumPy is slow along short rows.
    out = np.zeros((len(tracks) + 2, cells.count), dtype=np.float32)
    moved = np.full_like(out, np.inf)
    for k, t in enumerate(tracks, 1):
        out[k] = t.share
        if t.predicted_share is not None:
            moved[k] = t.predicted_share
    hidden = [
        (k, cells.mean(t.occluded)) for k, t in enumerate(tracks, 1) if t.occluded is not None
    ]
    for k, mean in hidden:
        # An occluder is expected only where its own motion takes it.
        there = np.flatnonzero(mean > 0.3)
        before = out[k, there]
        out[:, there] = np.minimum(out[:, there], moved[:, there])
        out[k, there] = before
    free = np.clip(1 - out.sum(axis=0), 0, 1)
    for k, mean in hidden:
        # A hidden track is expected back where its occluder has left.
        out[k] += free * np.maximum(mean - out[k], 0)
    out /= np.maximum(out.sum(axis=0), 1)
    out[0] = np.clip(1 - out.sum(axis=0), 0, 1)
    return np.ascontiguousarray(_sharpened(out).T)


def _sharpened(shares: Floats) -> Floats:
    """Label shares (K, count) pushed towards their winner, so that carried beliefs do not fade."""
    squared = shares * shares
    return np.asarray(squared / np.maximum(squared.sum(axis=0), 1e-6))
