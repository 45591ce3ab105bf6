"""The interpretation tree: which of an object's view hypotheses belong together (paper, figure 5).

At each observation of an object, matching offers some views of some models, some of them wrong. The tree of a
model has one level per observation; a path chooses at each level one hypothesis of the model, or none ("they
are all wrong"). Its cost is the sum of

    w * (best - similarity) / similarity_sigma      for a hypothesis chosen (best: of all models),
    w * wrong                                       for a level at which none is chosen,
    min(jump, swing^2 / 2 s^2 + roll^2 / 2 r^2)     between hypotheses chosen one after the other,

where w (at most 1) counts observations in quick succession as one, swing is the angle between the directions
and roll the in-plane rotation. The tolerance of rotation (s, r) grows with the time between both and with the
uncertainty of the spin; a known spin rotates the earlier orientation. A jump has a bounded cost, so that no
wrong hypothesis spoils a path for good, and both orientations of a symmetric object are retained until one of
them fits better.
 All paths that end in the same hypothesis share their future: only the cheapest must be retained, which is
dynamic programming and exact. A path more than a jump above the cheapest can never become part of a cheapest
path and is dropped, which is exact too. `most_paths` bounds the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from visup.agent import Hypothesis
from visup.agent.model.orientation import orientations, swing_and_roll
from visup.rules.pose._interpretation_tree_jit import NONE, Choices, Paths, TreeCosts, extend_paths
from visup.rules.pose.rotations import Floats, nearest_rotations


@dataclass(frozen=True, slots=True)
class TreeSettings:
    """Costs and bounds of the interpretation tree.

    Attributes:
        similarity_sigma: Loss of similarity that costs 1.
        wrong: Cost of calling all hypotheses of a level wrong.
        jump: Greatest cost of a rotation.
        other_view: Cost of another view where directions are unknown.
        swing_deg: Standard deviation of the angle between the views of an object at rest: views are
            some 15 degrees apart.
        roll_deg: The same for in-plane rotation.
        independent_s: Observations closer in time than this count in proportion.
        interpolate_deg: Hypotheses within this angle of each other are of one orientation, and are
            interpolated between their views.
        interpolate_similarity: Scale on which the weight of such a neighbour falls with its similarity
            when it is 20 degrees away. Similarity falls with the square of the angle, so that for
            wider spacing a greater difference carries the same information.
        most_hypotheses: Most hypotheses of one model and level, the most similar.
        most_paths: Most paths of one model, the cheapest.
        lag: Levels for which paths are stored.
    """

    similarity_sigma: float = 0.06
    wrong: float = 2.0
    jump: float = 5.0
    other_view: float = 1.0
    swing_deg: float = 14.0
    roll_deg: float = 12.0
    independent_s: float = 0.2
    interpolate_deg: float = 35.0
    interpolate_similarity: float = 0.06
    most_hypotheses: int = 8
    most_paths: int = 24
    lag: int = 24


@dataclass(frozen=True, slots=True)
class SpinPrior:
    """The prior of an object's rotation for the tree.

    Attributes:
        rate: (x, y, z) rotation vector per second, camera frame, radians.
        sigma: Standard deviation of each of its components.
    """

    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma: float = 0.35


@dataclass(frozen=True, slots=True, eq=False)
class TreeLevel:
    """The hypotheses of one model at one observation.

    Attributes:
        time: Seconds.
        views: (H,) numbers of the views.
        orientation: (H, 3, 3) model to camera; NaN where the direction is unknown.
        rolled: (H,) bool: whether the in-plane rotation is known.
        cost: (H,) unweighted cost of choosing each.
        between: (H, 3, 3) orientation interpolated among neighbouring hypotheses; its own if fitted to
            the picture.
        fitted: (H,) bool: whether each was fitted.
    """

    time: float
    views: NDArray[np.int64]
    orientation: Floats
    rolled: NDArray[np.bool_]
    cost: Floats
    between: Floats
    fitted: NDArray[np.bool_]


_NO_LEVEL = TreeLevel(
    0.0,
    np.zeros(0, np.int64),
    np.zeros((0, 3, 3)),
    np.zeros(0, bool),
    np.zeros(0),
    np.zeros((0, 3, 3)),
    np.zeros(0, bool),
)


@dataclass(frozen=True, slots=True, eq=False)
class InterpretationTree:
    """The paths of one model that may still turn out cheapest, each by its current end.

    Attributes:
        time: Seconds of the last level.
        cost: (S,) costs above that of the cheapest.
        view: (S,) last chosen view, or `NONE`.
        chosen: (S,) time of that choice, seconds.
        since: (S,) seconds since when that view was chosen each time.
        orientation: (S, 3, 3) of that choice.
        rolled: (S,) whether its in-plane rotation is known.
        path: (S, lag) hypotheses chosen at the last levels, oldest first, or `NONE`.
        total: Cost of the cheapest path.
    """

    time: float
    cost: Floats
    view: NDArray[np.int64]
    chosen: Floats
    since: Floats
    orientation: Floats
    rolled: NDArray[np.bool_]
    path: NDArray[np.int8]
    total: float = 0.0

    @property
    def best(self) -> int:
        """Number of the cheapest path."""
        return int(self.cost.argmin())

    @property
    def begun(self) -> bool:
        """Whether the cheapest path has chosen any hypothesis."""
        return bool(self.view[self.best] != NONE)


def empty_tree(settings: TreeSettings) -> InterpretationTree:
    """A tree without levels."""
    return InterpretationTree(
        -np.inf,
        np.zeros(1),
        np.full(1, NONE, np.int64),
        np.zeros(1),
        np.zeros(1),
        np.full((1, 3, 3), np.nan),
        np.zeros(1, bool),
        np.full((1, settings.lag), NONE, np.int8),
    )


def levels_of(
    hypotheses: Sequence[Hypothesis], time: float, settings: TreeSettings
) -> dict[str, TreeLevel]:
    """The levels from the hypotheses of one observation, by model.

    Args:
        hypotheses: At least one, in any order.
        time: Seconds.
        settings: Settings of the tree.
    """
    by_name: dict[str, list[Hypothesis]] = {}
    for h in sorted(hypotheses, key=lambda h: (-h.similarity, h.view, h.rotation or 0.0)):
        by_name.setdefault(h.name, []).append(h)
    selected = {name: hs[: settings.most_hypotheses] for name, hs in by_name.items()}
    whole = _level([h for hs in selected.values() for h in hs], time, settings)
    ends = np.cumsum([len(hs) for hs in selected.values()]).tolist()
    places = (slice(end - len(hs), end) for hs, end in zip(selected.values(), ends, strict=True))
    return {name: _part(whole, at, settings) for name, at in zip(selected, places, strict=True)}


def _level(hypotheses: Sequence[Hypothesis], time: float, settings: TreeSettings) -> TreeLevel:
    """One level of hypotheses of all models, not yet combined."""
    lost = (np.nan, np.nan, np.nan)
    similarity = np.array([h.similarity for h in hypotheses])
    orientation = orientations(
        np.array([h.direction or lost for h in hypotheses]),
        np.array([h.rotation or 0.0 for h in hypotheses]),
    )
    return TreeLevel(
        time,
        np.array([h.view for h in hypotheses]),
        orientation,
        np.array([h.rotation is not None for h in hypotheses]),
        (similarity.max() - similarity) / settings.similarity_sigma,
        orientation,
        np.array([h.fitted for h in hypotheses]),
    )


def _part(whole: TreeLevel, at: slice, settings: TreeSettings) -> TreeLevel:
    """The hypotheses of one model."""
    orientation, cost = whole.orientation[at], whole.cost[at]
    fitted = whole.fitted[at]
    between = _between(orientation, -cost * settings.similarity_sigma, settings)
    between = np.where(fitted[:, None, None], orientation, between)
    return TreeLevel(
        whole.time, whole.views[at], orientation, whole.rolled[at], cost, between, fitted
    )


def _between(orientation: Floats, similarity: Floats, settings: TreeSettings) -> Floats:
    """Interpolate hypotheses of similar orientation by their weighted mean."""
    if len(orientation) < 2 or np.isnan(orientation).any():
        return orientation
    swing, roll = swing_and_roll(orientation[:, None], orientation[None])
    near = np.hypot(swing, roll) < np.radians(settings.interpolate_deg)
    others = np.maximum(near.sum(axis=1) - 1, 1)
    apart = np.maximum((near * swing).sum(axis=1) / others, 1e-3) / np.radians(20.0)
    width = settings.interpolate_similarity * apart**2
    best = np.where(near, similarity, -np.inf).max(axis=1)
    less = np.minimum(similarity - best[:, None], 0.0)
    weight = near * np.exp(less / width[:, None])
    return nearest_rotations(np.tensordot(weight, orientation, axes=1))


def extended_tree(
    tree: InterpretationTree,
    level: TreeLevel | None,
    time: float,
    spin: SpinPrior,
    settings: TreeSettings,
) -> InterpretationTree:
    """Extend the tree by one observation.

    Args:
        tree: The tree before.
        level: The model's hypotheses, or None when there are only those of others.
        time: Seconds, not before the last level's.
        spin: Prior of the object's rotation.
        settings: Settings of the tree.
    """
    weight = look_weight(time - tree.time, settings)
    level = level or _NO_LEVEL
    s = settings
    costs = TreeCosts(
        time,
        weight,
        s.wrong,
        s.jump,
        s.other_view,
        radians(s.swing_deg),
        radians(s.roll_deg),
        spin.sigma,
        s.most_paths,
    )
    t = tree
    paths = Paths(t.cost, t.view, t.chosen, t.since, t.orientation, t.rolled, t.path)
    choices = Choices(level.views, level.orientation, level.rolled, level.cost)
    rate = np.array(spin.rate, dtype=float)  # for whole numbers the loop would be compiled anew
    found, increase = extend_paths(costs, paths, choices, rate)
    return InterpretationTree(time, *found, tree.total + increase)


def look_weight(waited: float, settings: TreeSettings) -> float:
    """Weight of an observation by the time since the last one, with which it is correlated."""
    return min(1.0, max(waited, 0.0) / settings.independent_s)


def rival_gap(tree: InterpretationTree, settings: TreeSettings) -> float:
    """Extra cost of the cheapest path that ends in a clearly different orientation.

    Returns:
        0 to `settings.jump`; the latter when there is no such path.
    """
    best = tree.best
    swing, roll = swing_and_roll(tree.orientation[best], tree.orientation)
    other = np.hypot(swing, roll) > np.radians(settings.interpolate_deg)
    other |= np.isnan(swing) & (tree.view != tree.view[best])
    return float(tree.cost[other].min()) if other.any() else settings.jump


def similarity_lead(level: TreeLevel, chosen: int, settings: TreeSettings) -> float:
    """Cost lead of a level's chosen hypothesis over the best of a clearly different orientation.

    Args:
        level: The hypotheses.
        chosen: Number of the chosen one, or `NONE`.
        settings: Settings of the tree; `wrong` bounds the lead, and is the lead without an alternative.

    Returns:
        -`wrong` to `wrong`; 0 when none is chosen.
    """
    if chosen == NONE:
        return 0.0
    swing, roll = swing_and_roll(level.orientation[chosen], level.orientation)
    other = np.hypot(swing, roll) > np.radians(settings.interpolate_deg)
    other |= np.isnan(swing) & (level.views != level.views[chosen])
    if not other.any():
        return settings.wrong
    ahead = float(level.cost[other].min() - level.cost[chosen])
    return min(max(ahead, -settings.wrong), settings.wrong)
