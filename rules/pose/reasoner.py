"""The pose reasoner: orientation and spin of objects, from their interpretation trees.

Every object has a tree for each recently hypothesised model (`interpretation_tree.py`). The cheapest path of
the most likely model gives the view, its start, and the orientations from which the spin is measured
(`angular_velocity.py`). The extra cost of other models' paths says what the object is not: `pose_support`,
which weighs the votes of the next step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import exp
from types import MappingProxyType

import numpy as np

from visup.agent import Hypothesis, Mind, ObjectBelief, Observation, Outcome, Pose, Presence
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.agent.model.orientation import views
from visup.rules.pose._interpretation_tree_jit import NONE
from visup.rules.pose.angular_velocity import (
    AngularVelocity,
    SpinSettings,
    estimate_angular_velocity,
    spin_of,
)
from visup.rules.pose.angular_velocity_fit import OrientationSeries
from visup.rules.pose.interpretation_tree import (
    InterpretationTree,
    SpinPrior,
    TreeLevel,
    TreeSettings,
    empty_tree,
    extended_tree,
    levels_of,
    look_weight,
    rival_gap,
    similarity_lead,
)
from visup.rules.pose.rotations import Floats, sight_rotation
from visup.rules.presence.association import hypotheses_by_object
from visup.rules.presence.reasoner import visible_share

USUAL_FOCAL = 1.2
"""Focal length of a usual lens, in widths of the image; the rotation inferred from an object's motion
across the image is wrong in proportion to the error."""

LookSignature = tuple[tuple[str, int, float, float | None], ...]
"""The hypotheses of an observation: (name, view, similarity, rotation) of each."""


FITTED = SpinSettings(swing_deg=2.5, roll_deg=2.5, view_deg=0.5, view_share=0.02, view_most_deg=1.0)
"""Spin settings for orientations accurate to some two degrees."""


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """Settings of the pose belief.

    Attributes:
        tree: Costs and bounds of the interpretation trees.
        spin: Spin settings for stored views.
        fitted_spin: Spin settings for orientations fitted to the image, which are accurate to two
            degrees and follow the object without steps.
        every_s: Least time between two observations used of one object.
        most_looks: Most objects whose trees grow in one step; those waiting longest come first. This
            bounds the most expensive part of reasoning by work, not time, so that results are the same
            on every machine.
        refit_s: Interval of spin measurements.
        least_visible: Below this visible share an object's hypotheses are ignored.
        most_names: Most models of an object that have trees.
        memory_s: Costs of models decay to 37 % in this time.
        free_cost: Extra cost of a model, above the cheapest, without loss of support.
        support_cost: Further extra cost that lowers its support to 37 %.
        stored_every_s: Least time between stored orientations for the spin.
        lead: How much a lead of the chosen hypotheses over clearly different ones, in units of their
            cost, adds to the log odds that the pose is right. Errors of similarity last as long as
            the view, so leads do not add up.
        unknown_spin_sigma: Standard deviation of an unknown spin for the tree, radians per second.
        least_spin_sigma: Least standard deviation of a known spin for the tree, radians per second.
        stale_s: Without an observation for this long, confidence falls to 37 %.
        spin_stale_s: Without an observation for this long, the spin is unknown.
    """

    tree: TreeSettings = field(default_factory=TreeSettings)
    spin: SpinSettings = field(default_factory=SpinSettings)
    fitted_spin: SpinSettings = field(default_factory=lambda: FITTED)
    every_s: float = 0.2
    most_looks: int = 4
    refit_s: float = 1.0
    least_visible: float = 0.5
    most_names: int = 6
    memory_s: float = 3.0
    free_cost: float = 6.0
    support_cost: float = 6.0
    stored_every_s: float = 0.2
    lead: float = 3.0
    unknown_spin_sigma: float = 0.35
    least_spin_sigma: float = 0.09
    stale_s: float = 10.0
    spin_stale_s: float = 8.0


@dataclass(frozen=True, eq=False)
class PoseTrack:
    """The memory of one object's views.

    Attributes:
        time: Seconds of the last observation, or minus infinity.
        signature: Its hypotheses; the same again means no new observation.
        trees: Model name -> its tree.
        levels: Model name -> its level, for each of the last observations.
        sights: For each of them, (3, 3): from a camera looking at the object to the actual camera.
        path_costs: Model name -> decayed cost of its cheapest path.
        other_cost: The same for a model that was never hypothesised.
        support: Model name -> compatibility of its strain with being the object, 0 to 1.
        other_support: The same for a model that was never hypothesised.
        name: The model whose orientations are in `orientations`.
        lead: Cost lead of its chosen hypotheses over clearly different ones, averaged over time.
        orientations: (seconds, orientation) along its cheapest path, older than the trees' levels.
        rate: Its angular velocity, or None when unknown.
        rate_measured_at: Seconds when the rate was measured.
        pose: The belief since the last observation, or None.
    """

    time: float = -np.inf
    signature: LookSignature = ()
    trees: Mapping[str, InterpretationTree] = field(default_factory=lambda: MappingProxyType({}))
    levels: tuple[Mapping[str, TreeLevel], ...] = ()
    sights: tuple[Floats, ...] = ()
    path_costs: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    other_cost: float = 0.0
    support: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    other_support: float = 1.0
    name: str = ""
    lead: float = 0.0
    orientations: tuple[tuple[float, Floats], ...] = ()
    rate: AngularVelocity | None = None
    rate_measured_at: float = -np.inf
    pose: Pose | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """One observation of an object.

    Attributes:
        time: Seconds.
        hypotheses: Hypotheses of views.
        sight: (3, 3) from a camera looking at the object to the actual camera.
    """

    time: float
    hypotheses: Sequence[Hypothesis]
    sight: Floats


POSES: MemoryKey[Mapping[int, PoseTrack]] = MemoryKey("rules.pose", MappingProxyType({}))


NO_TRACK = PoseTrack()


def pose_tracks(mind: Mind) -> Mapping[int, PoseTrack]:
    """Object id -> memory of its views."""
    return mind.recall(POSES)


def pose_support(mind: Mind, object_id: int, name: str) -> float:
    """Consistency of an object's views over time, if it is of a model.

    Args:
        mind: The mind after the last step.
        object_id: The object.
        name: The model.

    Returns:
        0 to 1: 1 for the model of least path cost and for those that cost little more; 1 as well when
        nothing is known of the object's views.
    """
    track = pose_tracks(mind).get(object_id)
    return 1.0 if track is None else track.support.get(name, track.other_support)


@dataclass(frozen=True, slots=True)
class PoseReasoner:
    """Reasoner of the cogitate phase: orientation and spin of each object. Runs after the votes."""

    settings: PoseSettings = PoseSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Update from one step's view hypotheses; see `Reasoner`."""
        hypotheses = hypotheses_by_object(mind, observation)
        known, tracks, beliefs = pose_tracks(mind), {}, []
        due = self._due(mind, hypotheses, known)
        for object_id, belief in mind.objects.items():
            track = known.get(object_id, NO_TRACK)
            if object_id in due:
                look = Look(mind.time, hypotheses[object_id], _sight(mind, belief))
                track = self._with_look(track, look, belief.name)
            if track.trees:
                tracks[object_id] = track
            pose = self._current_pose(track, belief.name, mind.time)
            if pose != belief.pose:
                beliefs.append(replace(belief, pose=pose))
        mind = mind.with_objects(*beliefs) if beliefs else mind
        return Outcome(mind.remember(POSES, MappingProxyType(tracks)))

    def _due(
        self,
        mind: Mind,
        matches: Mapping[int, tuple[Hypothesis, ...]],
        tracks: Mapping[int, PoseTrack],
    ) -> frozenset[int]:
        """Objects whose trees grow now: newly matched, not too soon, and within the budget."""
        s = self.settings
        waiting = [
            (track.time, object_id)
            for object_id, hypotheses in matches.items()
            if (track := tracks.get(object_id, NO_TRACK)).signature != _look_signature(hypotheses)
            and mind.time - track.time >= s.every_s - 1e-9
            and (belief := mind.objects.get(object_id)) is not None
            and self._in_sight(mind, belief)
        ]
        return frozenset(number for _, number in sorted(waiting)[: s.most_looks])

    def _in_sight(self, mind: Mind, belief: ObjectBelief) -> bool:
        seen = belief.presence is Presence.SEEN
        return seen and visible_share(mind, belief.id) >= self.settings.least_visible

    def _with_look(self, track: PoseTrack, look: Look, name: str) -> PoseTrack:
        """The track after an observation."""
        track = self._store_orientation(track, name)
        waited = look.time - track.time
        grown = self._extend_trees(replace(track, signature=_look_signature(look.hypotheses)), look)
        track = self._measure_rate(grown, name, look.time)
        track = self._update_lead(track, name, waited)
        return replace(track, pose=self._pose(track, name))

    def _extend_trees(self, track: PoseTrack, look: Look) -> PoseTrack:
        """Extend the trees by one level, and update the costs of their models."""
        s, now = self.settings, look.time
        levels = levels_of(look.hypotheses, now, s.tree)
        spin_prior = _spin_prior(track.rate, s)
        fade = exp(-min(now - track.time, 1e6) / s.memory_s)
        other_cost = track.other_cost * fade + look_weight(now - track.time, s.tree) * s.tree.wrong
        trees, costs = {}, {}
        for name in track.trees.keys() | levels.keys():
            before = track.trees.get(name) or empty_tree(s.tree)
            new = name not in track.trees
            # A model hypothesised for the first time was wrong at all earlier observations.
            before = replace(before, time=track.time) if new else before
            tree = extended_tree(before, levels.get(name), now, spin_prior, s.tree)
            past = track.other_cost if new else track.path_costs[name]
            trees[name], costs[name] = tree, past * fade + tree.total - before.total
        least_cost = min(costs.values())
        likeliest = sorted(trees, key=lambda n: (costs[n], n))[: s.most_names]
        return replace(
            track,
            time=now,
            trees=MappingProxyType({n: trees[n] for n in likeliest}),
            levels=(*track.levels, MappingProxyType(levels))[-s.tree.lag :],
            sights=(*track.sights, look.sight)[-s.tree.lag :],
            path_costs=MappingProxyType({n: costs[n] for n in likeliest}),
            other_cost=other_cost,
            support=MappingProxyType({n: self._support(costs[n] - least_cost) for n in likeliest}),
            other_support=self._support(other_cost - least_cost),
        )

    def _support(self, extra_cost: float) -> float:
        return exp(-max(0.0, extra_cost - self.settings.free_cost) / self.settings.support_cost)

    def _store_orientation(self, track: PoseTrack, name: str) -> PoseTrack:
        """Store the observation that the trees are about to drop; another name starts afresh."""
        s = self.settings
        if name != track.name:
            return replace(track, name=name, lead=0.0, orientations=(), rate=None)
        tree = track.trees.get(name)
        if tree is None or len(track.levels) < s.tree.lag:
            return track
        seen = _orientation(track.levels[0].get(name), int(tree.path[tree.best, 0]))
        if seen is None:
            return track
        time = track.levels[0][name].time
        if track.orientations and time - track.orientations[-1][0] < s.stored_every_s - 1e-9:
            return track
        oldest = time - s.spin.window_s
        orientations = (*track.orientations, (time, track.sights[0] @ seen))
        forgotten = orientations[0][0] < oldest
        return replace(track, orientations=orientations[1:] if forgotten else orientations)

    def _measure_rate(self, track: PoseTrack, name: str, now: float) -> PoseTrack:
        if now - track.rate_measured_at < self.settings.refit_s - 1e-9 or name not in track.trees:
            return track
        orientations = _orientation_series(track, name, self.settings.tree.lag)
        level = track.levels[-1].get(name)
        fitted = level is not None and bool(level.fitted.any())
        settings = self.settings.fitted_spin if fitted else self.settings.spin
        rate = estimate_angular_velocity(orientations, now, track.rate, settings)
        return replace(track, rate=rate, rate_measured_at=now)

    def _update_lead(self, track: PoseTrack, name: str, waited: float) -> PoseTrack:
        """The track with the lead of the chosen hypotheses updated."""
        level, tree = track.levels[-1].get(name), track.trees.get(name)
        if level is None or tree is None:
            return track
        fade = exp(-min(waited, 1e6) / self.settings.memory_s)
        now = similarity_lead(level, int(tree.path[tree.best, -1]), self.settings.tree)
        return replace(track, lead=track.lead * fade + now * (1.0 - fade))

    def _pose(self, track: PoseTrack, name: str) -> Pose | None:
        """The pose from the cheapest path of a model."""
        tree = track.trees.get(name)
        if tree is None or not tree.begun:
            return None
        k = tree.best
        orientation = _last_orientation(track, name, tree)
        if np.isnan(orientation).any():
            return None
        direction, rotation = views(orientation)
        x, y, z = direction.tolist()
        return Pose(
            name,
            int(tree.view[k]),
            (x, y, z),
            float(rotation) if tree.rolled[k] else None,
            since=float(tree.since[k]),
            confidence=self._confidence(track, tree),
            spin=spin_of(track.rate, self.settings.spin) if track.rate else None,
        )

    def _current_pose(self, track: PoseTrack, name: str, now: float) -> Pose | None:
        """The pose of the last observation, as far as it is still valid."""
        pose, age = track.pose, now - track.time
        if pose is None or pose.name != name or age <= 0.0:
            return pose if pose is None or pose.name == name else None
        spin = pose.spin if age < self.settings.spin_stale_s else None
        return replace(pose, confidence=pose.confidence * self._decay(age), spin=spin)

    def _confidence(self, track: PoseTrack, tree: InterpretationTree) -> float:
        """Confidence against the next best orientation: from path costs (log likelihoods) and the lead."""
        age = track.time - float(tree.chosen[tree.best])
        odds = min(rival_gap(tree, self.settings.tree), self.settings.lead * track.lead)
        return self._decay(age) / (1.0 + exp(-odds))

    def _decay(self, age: float) -> float:
        return exp(-max(0.0, age) / self.settings.stale_s)


def _sight(mind: Mind, belief: ObjectBelief) -> Floats:
    """The rotation from a camera looking at the object to the actual camera."""
    width, height = mind.frame_size
    x, y = belief.region.centroid
    return sight_rotation((x - width / 2, y - height / 2), USUAL_FOCAL * width)


def _look_signature(hypotheses: Sequence[Hypothesis]) -> LookSignature:
    return tuple((h.name, h.view, h.similarity, h.rotation) for h in hypotheses)


def _spin_prior(rate: AngularVelocity | None, settings: PoseSettings) -> SpinPrior:
    if rate is None or rate.sigma > settings.unknown_spin_sigma:
        return SpinPrior(sigma=settings.unknown_spin_sigma)
    x, y, z = rate.vector.tolist()
    return SpinPrior((x, y, z), max(rate.sigma, settings.least_spin_sigma))


def _orientation(level: TreeLevel | None, number: int) -> Floats | None:
    """The orientation of a level's hypothesis, if a path chose one."""
    if level is None or number == NONE or not level.rolled[number]:
        return None
    seen = level.between[number]
    return None if np.isnan(seen[0, 0]) else seen


def _orientation_series(track: PoseTrack, name: str, lag: int) -> OrientationSeries:
    """Orientations along the cheapest path of a model."""
    tree = track.trees[name]
    path = tree.path[tree.best, lag - len(track.levels) :]
    recent = [
        (levels[name].time, sight @ seen)
        for levels, sight, number in zip(track.levels, track.sights, path.tolist(), strict=True)
        if (seen := _orientation(levels.get(name), number)) is not None
    ]
    every = [*track.orientations, *recent]
    times = np.array([t for t, _ in every])
    return OrientationSeries(times, np.array([r for _, r in every]).reshape(-1, 3, 3))


def _last_orientation(track: PoseTrack, name: str, tree: InterpretationTree) -> Floats:
    """The last orientation of the cheapest path."""
    path = tree.path[tree.best].tolist()
    for levels, number in zip(reversed(track.levels), reversed(path), strict=False):
        if number != NONE:
            return np.asarray(levels[name].between[number])
    return np.asarray(tree.orientation[tree.best])
