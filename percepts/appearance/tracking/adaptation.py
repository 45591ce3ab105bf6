"""Adaptation of an object's appearance while it moves, and its rest memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.appearance_model import (
    Appearance,
    learned_filter,
    surroundings,
)
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.colours import learn_colours
from visup.percepts.appearance.models.pose import PatchPose, Window, cut_patch
from visup.percepts.appearance.models.rest_memory import remember_at_rest
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.track import TaughtObjectTrack, TrackState

Floats = NDArray[np.float32]

SURE_PEAK, SURE_SHARE = 0.4, 0.5  # no adaptation below these: it may be another object
SURE_COLOURS = 0.35  # colour excess from which the appearance is adapted all the same
# The rates below are shares of the new observation per update.
GROW_RATE, SHRINK_RATE = 0.08, 0.05  # of the mask, where it grows and where it shrinks
ANCHOR = np.float32(0.02)  # share by which the mask returns to the taught one
PIXEL_RATE, FILTER_RATE = 0.12, 0.04
COLOUR_RATE, AROUND_RATE = 0.02, 0.1  # of the colours of the object, and of its surroundings
PATH_S = 0.4  # length of a track's path, seconds
REST_SHARE = 0.7  # share of `PATH_S` for which an object must have been tracked to be at rest
STILL_PX, STILL_SHARE = 0.6, 0.01  # most apparent motion at rest: pixels, and share of its size


def adapt_appearance(
    track: TaughtObjectTrack,
    scene: Scene,
    claim: tuple[Window, Floats],
    blob: Blob,
    taught: Appearance,
) -> TaughtObjectTrack:
    """A track with its appearance adapted to the frame.

    Args:
        track: The track of a moving object.
        scene: The frame.
        claim: Its window and the log odds of the pixels there, before `assign_pixels`.
        blob: The pixels assigned to it by `assign_pixels`.
        taught: The taught view that it matches.
    """
    appearance, pose = track.appearance, track.pose
    sure = track.peak >= SURE_PEAK and track.explained_share >= SURE_SHARE
    if appearance is None or pose is None or not (sure or track.colour_excess >= SURE_COLOURS):
        return track
    lab = scene.patch(pose, appearance.shape)
    seen = _in_patch(blob.window, blob.mask, pose, appearance.shape, scene)
    # Pixels won by another object say nothing about the shape.
    taken = _in_patch(claim[0], claim[1] > 0, pose, appearance.shape, scene) - seen
    rate = np.where(seen > appearance.mask, GROW_RATE, SHRINK_RATE) * np.clip(1 - taken, 0, 1)
    # The shape is pulled back to the taught one, or it would spread over what it touches.
    back = ANCHOR * (taught.mask - appearance.mask)
    mask = (appearance.mask + rate * (seen - appearance.mask) + back).astype(np.float32)
    share = (np.float32(PIXEL_RATE) * seen)[..., None]
    pixels = _blended(appearance.lab, lab, share)
    seen_colours = learn_colours(
        lab, seen * appearance.mask, surroundings(np.maximum(appearance.mask, seen))
    )
    colours = appearance.colours.blended(seen_colours, COLOUR_RATE, AROUND_RATE)
    support = appearance.mask * np.clip(seen * 2, np.float32(0.3), 1)
    new_filter = learned_filter(lab, support.astype(np.float32), colours)
    return replace(
        track,
        appearance=Appearance(
            pixels, mask, colours, appearance.filter.blended(new_filter, FILTER_RATE)
        ),
    )


def refreshed(appearance: Appearance, lab: NDArray[np.uint8], rate: float) -> Appearance:
    """An appearance whose pixels and filter are replaced in part by those of a frame.

    Args:
        appearance: The appearance of an object.
        lab: (h, w, 3) uint8, Lab: its patch in the frame.
        rate: Share of the frame, 0 to 1.
    """
    share = (np.float32(rate) * appearance.mask)[..., None]
    fresh = learned_filter(lab, appearance.mask, appearance.colours)
    return replace(
        appearance,
        lab=_blended(appearance.lab, lab, share),
        filter=appearance.filter.blended(fresh, rate),
    )


def _blended(old: NDArray[np.uint8], new: NDArray[np.uint8], share: Floats) -> NDArray[np.uint8]:
    return np.round(old + share * (new.astype(np.float32) - old)).astype(np.uint8)


def relearn_appearance(
    appearance: Appearance, pose: PatchPose, blob: Blob, scene: Scene
) -> Appearance:
    """A new appearance of an object of which only the colours still match: turned, or in another light.

    Args:
        appearance: Its appearance so far.
        pose: Its pose.
        blob: Its pixels.
        scene: The frame.
    """
    lab = scene.patch(pose, appearance.shape)
    mask = _in_patch(blob.window, blob.mask, pose, appearance.shape, scene)
    return Appearance(lab, mask, appearance.colours, learned_filter(lab, mask, appearance.colours))


def _in_patch(
    window: Window, mask: NDArray[np.bool_], pose: PatchPose, shape: tuple[int, ...], scene: Scene
) -> Floats:
    """(h, w) float32: a mask of the image in the patch of an object at a pose."""
    left, top, right, bottom = window
    whole = np.zeros(scene.size[::-1], dtype=np.float32)
    whole[top:bottom, left:right] = mask
    return np.asarray(cut_patch(whole, pose, shape), dtype=np.float32)


def put_at_rest(track: TaughtObjectTrack, scene: Scene, first: bool) -> TaughtObjectTrack:
    """Put a track that has not moved for a while at rest.

    Args:
        track: The track of an object that is not known to rest.
        scene: The frame.
        first: Whether it is the first frame, in which everything is assumed at rest.
    """
    appearance, pose = track.appearance, track.pose
    if appearance is None or pose is None or track.visible is None or not track.path:
        return track
    if not first and scene.time - track.path[0][0] < REST_SHARE * PATH_S:
        return track
    largest_motion = max(p.apart(pose, appearance.radius) for _, p in track.path)
    if largest_motion > still_px(track):
        return track
    memory = remember_at_rest(scene, track.visible)
    return replace(track, state=TrackState.RESTING, rest=memory)


def still_px(track: TaughtObjectTrack) -> float:
    """Most apparent motion of a track at rest, working pixels."""
    if track.appearance is None or track.pose is None:
        return STILL_PX
    return STILL_PX + STILL_SHARE * track.appearance.radius * track.pose.scale
