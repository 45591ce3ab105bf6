"""Look-alike objects: which one of them a position belongs to."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from visup.percepts.appearance.looks.patches import ALIKE
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance, ViewModel
from visup.percepts.appearance.tracking.finding import SURE, ThingPlace, home_of
from visup.percepts.appearance.tracking.verification import verify

LookAlikes = dict[int, frozenset[int]]
"""Number of each view -> numbers of views of other objects that look like it."""


def look_alikes(views: Sequence[ViewModel]) -> LookAlikes:
    """Views of different objects that look alike: each is detected where the other was taught."""
    like = {
        (i, k)
        for (i, one), (k, other) in permutations(enumerate(views), 2)
        if one.name != other.name and _like(one.appearance, other.appearance)
    }
    count = range(len(views))
    return {i: frozenset(k for k in count if {(i, k), (k, i)} <= like) for i in count}


def _like(it: Appearance, other: Appearance) -> bool:
    if it.colours.shared(other.colours) < ALIKE:
        return False  # without this, an object that is merely visible beside the other would match
    height, width = other.shape
    shown = Scene(0.0, [other.lab], np.ascontiguousarray(other.lab[..., 0]), (width, height))
    middle = PatchPose((width - 1) / 2, (height - 1) / 2, other.radius / it.radius)
    return verify(shown, it, middle).score > SURE


def settled(
    scene: Scene,
    place: ThingPlace,
    views: Sequence[ViewModel],
    alike: LookAlikes,
    sought: Collection[str],
) -> ThingPlace:
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
    rivals = [k for k in sorted(alike[place.number]) if views[k].name in sought]
    pose = place.match.pose
    number = min([place.number, *rivals], key=lambda k: pose.apart(home_of(scene, views[k]), 0))
    if number == place.number:
        return place
    return replace(place, name=views[number].name, number=number, looks=views[number].appearance)
