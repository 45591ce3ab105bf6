"""The interpretation tree: which of an object's view hypotheses belong together (paper, figure 5).

Each time an object is looked at, matching offers some views of some models, and some of them are wrong. The
tree of a model has one level for each look; a path chooses at each level one hypothesis of the
model, or none of them ("they are all wrong"). Its cost is the sum of

    w * (best - similarity) / similarity_sigma      for a hypothesis chosen (best: of all models),
    w * wrong                                       for a level at which none is chosen,
    min(jump, swing^2 / 2 s^2 + roll^2 / 2 r^2)     between hypotheses chosen one after the other,

where w (at most 1) makes looks that follow each other closely count as one, swing is the angle between
the directions and roll the turn in the plane. How far an object may turn free of much cost (s, r) grows
with the time between both and with how uncertain its spin is; a spin believed turns the earlier
orientation on. A jump has a bounded cost, so that no wrong hypothesis spoils a path for good, and
the two orientations of a symmetric object are both kept until one of them fits better.

All paths that end in the same hypothesis share their future: only the cheapest must be kept, which is
dynamic programming and exact. What ends more than a jump dearer than the cheapest can never be on
a cheapest path again and is dropped, which is exact too. `most_paths` bounds what is left.
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
        similarity_sigma: So much less similarity costs 1.
        wrong: Cost of calling all hypotheses of a level wrong.
        jump: Greatest cost of a turn.
        other_view: Cost of another view where directions are not known.
        swing_deg: Standard deviation of the angle between the views of an object that stands still:
            views are some 15 degrees apart.
        roll_deg: The same of the turn in the plane.
        independent_s: Looks that follow each other faster than this count in proportion.
        interpolate_deg: Hypotheses within this angle of each other are of one orientation, and
            tell together what lies between their views.
        interpolate_similarity: How fast the weight of such a neighbour falls with its similarity when
            it is 20 degrees away. Similarity falls with the square of the angle, so that where views
            stand wider apart a greater difference tells as much.
        most_hypotheses: Of one model and level, the most similar.
        most_paths: Of one model; the cheapest.
        lag: Levels for which paths are remembered.
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
    """How an object is believed to turn, as far as the tree is concerned.

    Attributes:
        rate: (x, y, z) rotation vector per second, camera frame, radians.
        sigma: Standard deviation of each of its components.
    """

    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma: float = 0.35


@dataclass(frozen=True, slots=True, eq=False)
class TreeLevel:
    """The hypotheses of one model at one look.

    Attributes:
        time: Seconds.
        views: (H,) numbers of the views.
        orientation: (H, 3, 3) model to camera; NaN where the direction is not known.
        rolled: (H,) bool: whether the turn in the plane is known.
        cost: (H,) of choosing each, not yet weighted.
        between: (H, 3, 3) orientation that neighbouring hypotheses tell together with each; its own of one
            that was fitted to the picture.
        fitted: (H,) bool: whether each was.
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
        view: (S,) view chosen last, or `NONE`.
        chosen: (S,) seconds at which it was chosen.
        since: (S,) seconds since when that view was chosen each time.
        orientation: (S, 3, 3) of that choice.
        rolled: (S,) whether its turn in the plane is known.
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
    """A tree without any level."""
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
    """The levels that the hypotheses of one look make, by model.

    Args:
        hypotheses: At least one, in any order.
        time: Seconds.
        settings: Of the tree.
    """
    by_name: dict[str, list[Hypothesis]] = {}
    for h in sorted(hypotheses, key=lambda h: (-h.similarity, h.view, h.rotation or 0.0)):
        by_name.setdefault(h.name, []).append(h)
    kept = {name: hs[: settings.most_hypotheses] for name, hs in by_name.items()}
    whole = _level([h for hs in kept.values() for h in hs], time, settings)
    ends = np.cumsum([len(hs) for hs in kept.values()]).tolist()
    places = (slice(end - len(hs), end) for hs, end in zip(kept.values(), ends, strict=True))
    return {name: _part(whole, at, settings) for name, at in zip(kept, places, strict=True)}


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
    """What hypotheses of about one orientation tell together: their weighted mean."""
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
    """The tree after one more look.

    Args:
        tree: Before.
        level: The model's hypotheses, or None when only others were hypothesised.
        time: Seconds, not before the last level's.
        spin: How the object is believed to turn.
        settings: Of the tree.
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
    found, dearer = extend_paths(costs, paths, choices, np.array(spin.rate))
    return InterpretationTree(time, *found, tree.total + dearer)


def look_weight(waited: float, settings: TreeSettings) -> float:
    """Weight of an observation by the time since the last one: shortly after it, the same is seen."""
    return min(1.0, max(waited, 0.0) / settings.independent_s)


def rival_gap(tree: InterpretationTree, settings: TreeSettings) -> float:
    """How much dearer the cheapest path is that ends in quite another orientation than the best.

    Returns:
        0 to `settings.jump`; the latter when there is no such path.
    """
    best = tree.best
    swing, roll = swing_and_roll(tree.orientation[best], tree.orientation)
    other = np.hypot(swing, roll) > np.radians(settings.interpolate_deg)
    other |= np.isnan(swing) & (tree.view != tree.view[best])
    return float(tree.cost[other].min()) if other.any() else settings.jump


def similarity_lead(level: TreeLevel, chosen: int, settings: TreeSettings) -> float:
    """By how much less a level's chosen hypothesis costs than the best of quite another orientation.

    Args:
        level: The hypotheses.
        chosen: Number of the chosen one, or `NONE`.
        settings: Of the tree; `wrong` bounds the lead, and is that over no other at all.

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
