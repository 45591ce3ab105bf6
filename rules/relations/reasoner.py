"""The relation reasoner: relations of all pairs of objects, in one vectorised pass per step.

The distance whose trend is classified is the signed distance of the outlines' convex hulls: it continues
smoothly through zero into penetration depth when one body moves in front of another, and does not depend on
the centroid of a body cut by the image border (paper, section 7.4, fits the trend of the tracking data by a
line). Each relation has a threshold to enter and another to leave, both relative to the noise of the fit, and
a least duration. Thresholds in pixels are stated for an image diagonal of 800 px (640 x 480) and scale with
the diagonal.
 A shrinking image distance does not mean that bodies approach in space. Where the depth of both is known, its
trend counts too, and a relation on which the two disagree is unknown; where it is unknown the image alone
decides and the confidence is capped at `image_only_confidence`. Relations about depth itself
(`nearing_in_depth`, ...) are unknown without depth.

How to query them:

- `related(mind, name, a, b) -> Truth`: any relation of two objects, those of `NAMES` among them;
- `relation_of(mind, name, a, b) -> Relation | None`: the same with confidence, value, start;
- `qtc(mind, a, b) -> str | None`: QTC-C such as '-0+0'; its first two signs are QTC-B;
- `kinematics(mind).pair(quantity, a, b) -> float`: 'gap', 'rate', 'relative_speed', 'rate_sigma',
  'time_to_contact'; NaN unknown; `kinematics(mind).interval(quantity, a, b) -> (low, high)`;
- `kinematics(mind).one(quantity, a) -> float`: 'speed', 'depth';
- `zones.inside(mind, object_id, zone_name) -> Truth`, and more in `zones.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from visup.agent import (
    Column,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Relation,
    RelationTable,
    Truth,
)
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.agent.model.relation_columns import ColumnLayout, RelationBlock
from visup.rules.geometry._fit_jit import binned_trends
from visup.rules.geometry.pairs import pairs, reindexing
from visup.rules.geometry.regions import RCC8, Floats, image_diagonal
from visup.rules.presence.object_tracks import merged_pairs
from visup.rules.relations._pair_states_jit import (
    COUPLED,
    MERGED,
    MotionLimits,
    PairBeliefs,
    PairMotion,
    classify_motion,
    relation_rows,
    smoothed_boxes,
    smoothed_outlines,
)
from visup.rules.relations._thresholds_jit import classify_boxes, signs_with_hysteresis
from visup.rules.relations.direction import CONVERSE as DIRECTION_CONVERSE
from visup.rules.relations.direction import DIRECTION_NAMES
from visup.rules.relations.distance import CLASS_NAMES
from visup.rules.relations.kinematics import (
    Kinematics,
    KinematicsEstimator,
    RelationSettings,
    sightings,
)
from visup.rules.relations.qtc import text
from visup.rules.relations.rcc8 import (
    CONVERSE,
    from_outline_signs,
    from_signs,
    outline_differences,
)
from visup.rules.relations.rows import (
    AWAY,
    BOX_ROWS,
    MOTION,
    MOTION_AND_DEPTH,
    ORDER,
    OUTLINE,
    ROWS,
    SIDE,
    StateRow,
)
from visup.rules.relations.rows import TableRow as T
from visup.rules.relations.rows import ValueRow as V
from visup.rules.relations.samples import SampleWindow, covers_window, drifted, sampled
from visup.rules.relations.thresholds import least_durations, limits
from visup.rules.relations.trend import CONVERGING, DIVERGING, KEEPING, TREND_NAMES
from visup.rules.smoothing.ema import new_share
from visup.rules.smoothing.hysteresis import (
    UNKNOWN,
    Codes,
    HysteresisState,
    advance,
    unknown_states,
)

DEPTH_NAMES = ("nearing_in_depth", "keeping_in_depth", "parting_in_depth")
TOWARDS_NAMES = ("moving_towards", "steady_to", "moving_away_from")
SIDE_NAMES = ("moving_left_of", "", "moving_right_of")
OUTLINE_NAMES = tuple(f"outlines_{name}" for name in RCC8)
NAMES = tuple(
    name
    for names in (
        TREND_NAMES,
        ("touching", "moving_together"),
        DEPTH_NAMES,
        RCC8,
        OUTLINE_NAMES,
        TOWARDS_NAMES,
        SIDE_NAMES,
        DIRECTION_NAMES,
        CLASS_NAMES,
    )
    for name in names
    if name
)
"""Every relation of two objects decided here; `coupled` is decided by `coupling/reasoner.py`."""

COLUMNS = ColumnLayout(
    (
        Column(TREND_NAMES, (T.TREND, T.TREND), V.TREND_CERTAINTY, V.RATE, V.SIGMA),
        Column(("", "touching"), (T.TOUCH, T.TOUCH), V.MOST, V.GAP),
        Column(("", "moving_together"), (T.TOGETHER, T.TOGETHER), V.MOST, V.RELATIVE_SPEED),
        Column(RCC8, (T.BOXES, T.BOXES_CONVERSE), V.CERTAIN, listed="one"),
        Column(("distance",), (T.GAP, T.GAP), V.CERTAIN, V.GAP),
        Column(OUTLINE_NAMES, (T.OUTLINES, T.OUTLINES_CONVERSE), V.CERTAIN, listed="none"),
        Column(DEPTH_NAMES, (T.DEPTH, T.DEPTH), V.MOST, listed="none"),
        Column(TOWARDS_NAMES, (T.FIRST_AWAY, T.SECOND_AWAY), V.MOST, listed="none"),
        Column(SIDE_NAMES, (T.FIRST_SIDE, T.SECOND_SIDE), V.MOST, listed="none"),
        Column(CLASS_NAMES, (T.DISTANCE, T.DISTANCE), V.CERTAIN, V.GAP, listed="none"),
        Column(DIRECTION_NAMES, (T.DIRECTION, T.DIRECTION_CONVERSE), V.CERTAIN),
    )
)
"""The meaning of the rows of `relation_rows`."""


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedGeometry:
    """Smoothed positions of objects; see `ema.py`.

    Attributes:
        time: Seconds of the last step.
        boxes: (M, 4) x, y, width, height, pixels.
        gap: (P,) of the outlines, pixels.
        outlines: (3, P) pixels; see `outline_differences`.
    """

    time: float
    boxes: Floats
    gap: Floats
    outlines: Floats


def _no_geometry() -> SmoothedGeometry:
    return SmoothedGeometry(0.0, np.zeros((0, 4)), np.zeros(0), np.zeros((3, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class RelationMemory:
    """The memory of the relations.

    Attributes:
        history: Samples for fits.
        measured: Quantities of the last step.
        states: (ROWS, P) states of the pairs of the history's objects.
        rcc8: (2, P) RCC-8 of boxes and of outlines, derived from some of these states.
        smooth: The geometry from which position states are decided.
        drift: (M, 2) accumulated image motion of each object due to the camera, pixels.
        settings: The settings by which they are decided, for others that decide by the same limits.
    """

    history: SampleWindow = field(default_factory=SampleWindow)
    measured: Kinematics = field(default_factory=Kinematics)
    states: HysteresisState = field(default_factory=lambda: unknown_states((ROWS, 0), 0.0))
    rcc8: HysteresisState = field(default_factory=lambda: unknown_states((2, 0), 0.0))
    smooth: SmoothedGeometry = field(default_factory=lambda: _no_geometry())
    drift: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    settings: RelationSettings = field(default_factory=RelationSettings)


RELATIONS = MemoryKey("rules.relations", RelationMemory())


def kinematics(mind: Mind) -> Kinematics:
    """The quantities of the last step, as stored by `RelationReasoner`."""
    return mind.recall(RELATIONS).measured


def sample_window(mind: Mind) -> SampleWindow:
    """The last samples of all bodies, as stored by `RelationReasoner`."""
    return mind.recall(RELATIONS).history


def relation_settings(mind: Mind) -> RelationSettings:
    """The settings of the run's `RelationReasoner`; the defaults before its first step."""
    return mind.recall(RELATIONS).settings


def relation_of(mind: Mind, name: str, a: int, b: int) -> Relation | None:
    """A relation of two objects in this order, or None if it is not decided."""
    return mind.relation(name, a, b)


def related(mind: Mind, name: str, a: int, b: int) -> Truth:
    """Whether a relation holds from a to b; unknown if it is not decided.

    Args:
        mind: The mind after this step's relations.
        name: One of `NAMES`, `coupled`, or a plug-in's own.
        a: An object.
        b: Another object; the order matters for RCC-8's proper parts, movements and directions.
    """
    found = mind.relation(name, a, b)
    return Truth.UNKNOWN if found is None else found.truth


def qtc(mind: Mind, a: int, b: int) -> str | None:
    """QTC-C of two objects, such as '-0+0', or None while unknown; see `qtc.py`."""
    memory = mind.recall(RELATIONS)
    k, turned = RelationTable(memory.history.ids).pair(a, b)
    if k < 0:
        return None
    order = slice(None, None, -1) if turned else slice(None)
    state = memory.states.state
    return text(*(int(c) for rows in (AWAY, SIDE) for c in state[rows, k][order]))


@dataclass(frozen=True, slots=True)
class RelationReasoner:
    """Reasoner of the cogitate phase: decides all relations of all pairs of present objects."""

    settings: RelationSettings = field(default_factory=RelationSettings)
    _durations_s: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_durations_s", self._durations())

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        s = self.settings
        memory = mind.recall(RELATIONS)
        objects = mind.present()
        before = _reindexed_memory(memory, tuple(b.id for b in objects), mind.time)
        drift = drifted(before.drift, objects, observation)
        reach = s.window_s, s.samples
        history = sampled(memory.history, objects, mind, observation, drift, reach)
        seen = sightings(objects, mind.time)
        now = KinematicsEstimator(s)(history, objects, seen, mind, memory.measured)
        smooth = self._smooth(before.smooth, now, objects, seen, mind)
        candidates = self._candidate_states(before.states, history, now, smooth, mind)
        states = advance(before.states, candidates, mind.time, self._durations_s)
        rcc8 = before.rcc8
        if states is not before.states:  # otherwise the derived relations are unchanged
            state = states.state
            derived = np.array((from_signs(state[ORDER]), from_outline_signs(state[OUTLINE])))
            rcc8 = advance(rcc8, derived, mind.time, 0.0)
        memory = RelationMemory(history, now, states, rcc8, smooth, drift, s)
        table = RelationTable(now.ids, (self._cells(memory, mind),))
        return Outcome(mind.remember(RELATIONS, memory, relations=table))

    def _durations(self) -> Floats:
        s = self.settings
        lasts = np.full((ROWS, 1), s.touch_minimum_s)
        lasts[:BOX_ROWS] = least_durations(s.thresholds)
        lasts[[StateRow.TREND, StateRow.TOGETHER, StateRow.DEPTH]] = s.trend_minimum_s
        return lasts

    def _candidate_states(
        self,
        before: HysteresisState,
        h: SampleWindow,
        now: Kinematics,
        smooth: SmoothedGeometry,
        mind: Mind,
    ) -> Codes:
        s, diagonal = self.settings, image_diagonal(mind.frame_size)
        codes = np.empty(before.state.shape, dtype=np.int8)
        bounds = limits(s.thresholds, diagonal)
        classify_boxes(before.state, smooth.boxes, now.velocity, now.velocity_sigma, bounds, codes)
        codes[StateRow.DEPTH] = self._depth_trend(h)
        motion = PairMotion(
            now.tables, now.motion, now.speed, now.depth, smooth.gap, _marks(h.ids, mind)
        )
        classify_motion(
            before.state[MOTION],
            before.pending[MOTION],
            motion,
            self._limits(diagonal),
            codes[MOTION_AND_DEPTH],
        )
        level = s.thresholds.level_enter * diagonal, s.thresholds.level_exit * diagonal
        codes[OUTLINE] = signs_with_hysteresis(smooth.outlines, before.state[OUTLINE], *level)
        return codes

    def _limits(self, diagonal: float) -> MotionLimits:
        s = self.settings
        return MotionLimits(
            (s.rate_enter * diagonal, s.rate_exit * diagonal),
            (s.sigmas, s.pending_sigmas),
            (s.touch_enter * diagonal, s.touch_exit * diagonal, s.apart_exit, s.apart_depth),
            (s.still_speed * diagonal, s.still_half * diagonal, s.together_exit, s.moving_exit),
        )

    def _smooth(
        self,
        before: SmoothedGeometry,
        now: Kinematics,
        objects: tuple[ObjectBelief, ...],
        seen: Floats,
        mind: Mind,
    ) -> SmoothedGeometry:
        """Smoothed boxes, including those last seen a moment ago; gaps; outlines that may meet."""
        s, diagonal = self.settings, image_diagonal(mind.frame_size)
        share, jump = new_share(mind.time - before.time), 6.0 * s.thresholds.noise_px
        pair_jump, near_gap = jump * sqrt(2.0), 2.0 * s.thresholds.level_enter * diagonal
        boxes, gap, near_pairs = smoothed_boxes(
            before.boxes, before.gap, seen, now.tables, (share, jump, pair_jump, s.hold_s, near_gap)
        )
        differences = outline_differences([b.region for b in objects], near_pairs.tolist())
        outlines = smoothed_outlines(
            before.outlines, gap, near_pairs, differences, (share, pair_jump, 0.05 * diagonal)
        )
        return SmoothedGeometry(mind.time, boxes, gap, outlines)

    def _depth_trend(self, h: SampleWindow) -> Codes:
        """Trend of the difference in depth: a code per pair, UNKNOWN where depth is unknown."""
        i, j = pairs(len(h.ids))
        codes = np.full(len(i), UNKNOWN, dtype=np.int8)
        found_at = h.depth == h.depth  # NaN is not equal to itself
        if not found_at.any() or not covers_window(h, self.settings.window_s):
            return codes
        known = found_at.mean(axis=0) >= 0.6
        at = np.flatnonzero(known[i] & known[j])
        if len(at) == 0:
            return codes
        first, second = h.depth[:, i[at]], h.depth[:, j[at]]
        slope, sigma = binned_trends(h.times, np.abs(first - second), self.settings.bins)
        typical = 0.5 * np.nanmean(first + second, axis=0)
        least = np.maximum(self.settings.depth_rate * typical, 3.0 * sigma)
        found = np.full(len(at), KEEPING, dtype=np.int8)
        found[slope < -least] = CONVERGING
        found[slope > least] = DIVERGING
        codes[at] = found
        return codes

    def _cells(self, memory: RelationMemory, mind: Mind) -> RelationBlock:
        s, now = self.settings, memory.measured
        floor = s.rate_enter * image_diagonal(mind.frame_size) / 3.0
        beliefs = PairBeliefs(
            memory.states.state, memory.states.since, memory.rcc8.state, memory.rcc8.since
        )
        found = relation_rows(
            beliefs,
            now.tables,
            now.depth,
            (CONVERSE, DIRECTION_CONVERSE),
            (mind.time, s.image_only_confidence, floor),
        )
        return RelationBlock(COLUMNS, *found)


def _reindexed_memory(memory: RelationMemory, ids: tuple[int, ...], now: float) -> RelationMemory:
    """The memory re-indexed for other objects."""
    if memory.history.ids == ids:
        return memory
    rows, numbers = reindexing(memory.history.ids, ids)
    drift = np.append(memory.drift, np.zeros((1, 2)), axis=0)[rows]
    smooth = SmoothedGeometry(
        memory.smooth.time,
        np.append(memory.smooth.boxes, np.full((1, 4), np.nan), axis=0)[rows],
        np.append(memory.smooth.gap, np.nan)[numbers],
        np.append(memory.smooth.outlines, np.full((3, 1), np.nan), axis=1).take(numbers, axis=1),
    )
    states, rcc8 = memory.states.select(numbers, now), memory.rcc8.select(numbers, now)
    return replace(memory, states=states, rcc8=rcc8, smooth=smooth, drift=drift)


def _marks(ids: tuple[int, ...], mind: Mind) -> Codes:
    """(P,) marks of pairs that are coupled, or merged in one region."""
    table = RelationTable(ids)
    marks = np.zeros(len(ids) * (len(ids) - 1) // 2, dtype=np.int8)
    for mark, found in (
        (COUPLED, [c.objects for c in mind.couplings]),
        (MERGED, merged_pairs(mind)),
    ):
        for pair in found:
            k, _ = table.pair(*pair)
            if k >= 0:
                marks[k] |= mark
    return marks
