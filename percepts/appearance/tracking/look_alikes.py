"""Look-alike objects: which one of them a position belongs to."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from visup.percepts.appearance.models.appearance_model import Appearance, ViewModel
from visup.percepts.appearance.models.colour_patches import MIN_SIMILARITY
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.redetection import SURE, RedetectionCandidate, taught_pose
from visup.percepts.appearance.tracking.verification import verify

LookAlikes = dict[int, frozenset[int]]
"""Number of each view -> numbers of views of other objects that look like it."""


def look_alikes(views: Sequence[ViewModel]) -> LookAlikes:
    """Views of different objects that look alike: each is detected where the other was taught."""
    like = {
        (i, k)
        for (i, one), (k, other) in permutations(enumerate(views), 2)
        if one.name != other.name and _look_alike(one.appearance, other.appearance)
    }
    count = range(len(views))
    return {i: frozenset(k for k in count if {(i, k), (k, i)} <= like) for i in count}


def _look_alike(appearance: Appearance, other: Appearance) -> bool:
    if appearance.colours.shared(other.colours) < MIN_SIMILARITY:
        return False  # without this, an object that is merely visible beside the other would match
    height, width = other.shape
    shown = Scene(0.0, [other.lab], np.ascontiguousarray(other.lab[..., 0]), (width, height))
    middle = PatchPose((width - 1) / 2, (height - 1) / 2, other.radius / appearance.radius)
    return verify(shown, appearance, middle).score > SURE


def resolve_look_alike(
    scene: Scene,
    place: RedetectionCandidate,
    views: Sequence[ViewModel],
    alike: LookAlikes,
    sought: Collection[str],
) -> RedetectionCandidate:
    """Resolve a position among look-alikes: it belongs to the one taught nearest to it.

    Objects are searched one after another; of two equal ones the first would take any position that comes
    into view. The taught positions are the only information that separates them.

    Args:
        scene: The frame.
        place: Where one object was detected.
        views: All taught views.
        alike: Which of them look alike.
        sought: Names of the objects not in view.
    """
    rivals = [k for k in sorted(alike[place.view_number]) if views[k].name in sought]
    pose = place.match.pose
    number = min(
        [place.view_number, *rivals], key=lambda k: pose.apart(taught_pose(scene, views[k]), 0)
    )
    if number == place.view_number:
        return place
    return replace(
        place, name=views[number].name, view_number=number, appearance=views[number].appearance
    )
