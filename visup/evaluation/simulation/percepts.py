"""Percepts simulated from the truth of a mission, with realistic errors.

They separate the evaluation of reasoning from perception: outlines have errors of pixels, regions are missing
at times, singly and in runs, and the first name of a region is often wrong, also in runs. The truth is used
for nothing else: the agent processes these percepts like any others.

Read next: `hypotheses.py` (reports about one region), then `reasoning/simulated_missions.py` (the
evaluation).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Depth,
    Directive,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
)
from visup.agent.contract.behaviour import Behaviour, Contract
from visup.agent.execution.pipeline import ordered_slots, perceive
from visup.evaluation.simulation.hypotheses import HypothesisSource, NamingNoise
from visup.evaluation.simulation.truth_masks import ContourNoise, Mission, displaced_distance
from visup.testing import region_of

CONFIDENCE = 0.9
"""Confidence of a simulated region."""


@dataclass(frozen=True, slots=True)
class PerceptNoise:
    """The errors of percepts.

    Attributes:
        seed: Random seed.
        contour_px: Standard deviation of an outline along its normal, pixels.
        contour_length_px: Correlation length of that error along the outline, pixels.
        contour_tau_s: Time constant of the persistent half of that error, seconds.
        missing: Share of an object's frames without its region.
        in_bursts: Share of these that occur in runs; the others are single.
        burst_s: Mean length of such a run, seconds.
        velocity: Standard deviation of each component of a region's velocity, pixels per second.
        velocity_share: The same as a share of its speed, added.
        velocity_tau_s: Time constant of that error, seconds.
        wrong: Share of reports with a wrong first name.
        wrong_run_s: Mean length of a run of wrong names, seconds.
        listed: Probability that the right name is among the others if the first one is wrong.
        depth: Relative standard deviation of depth.
        names_every_s: Least time between two reports of names, seconds.
        min_visible_px: Least visible area of an object for a region, pixels.
        fresh_id_s: Time without a region after which a tracker assigns a new id, seconds.
        merge_coupled: Whether the regions of coupled objects merge, as in motion segmentation of objects that
            move alike.
    """

    seed: int = 0
    contour_px: float = 2.0
    contour_length_px: float = 15.0
    contour_tau_s: float = 1.0
    missing: float = 0.15
    in_bursts: float = 0.5
    burst_s: float = 0.2
    velocity: float = 0.7
    velocity_share: float = 0.1
    velocity_tau_s: float = 0.2
    wrong: float = 0.3
    wrong_run_s: float = 0.4
    listed: float = 0.7
    depth: float = 0.03
    names_every_s: float = 0.2
    min_visible_px: int = 150
    fresh_id_s: float = 0.8
    merge_coupled: bool = False


class Dropouts:
    """Dropouts of an object's region, single or in runs.

    Args:
        noise: The errors.
        dt: Seconds between frames.
        rng: Random generator.
    """

    def __init__(self, noise: PerceptNoise, dt: float, rng: np.random.Generator) -> None:
        share = noise.missing * noise.in_bursts
        self._end_probability = min(1.0, dt / noise.burst_s)
        self._begin_probability = self._end_probability * share / max(1.0 - share, 1e-9)
        self._single_probability = (noise.missing - share) / max(1.0 - share, 1e-9)
        self._rng = rng
        self._in_burst = rng.random() < share

    def missing(self) -> bool:
        """Whether it is missing in the next frame."""
        draw = self._rng.random()
        self._in_burst = (
            draw >= self._end_probability if self._in_burst else draw < self._begin_probability
        )
        return self._in_burst or self._rng.random() < self._single_probability


@dataclass(slots=True)
class _ObjectNoise:
    """The error state of one object, or of several with a merged region."""

    contour: ContourNoise
    gaps: Dropouts
    rng: np.random.Generator
    number: int = 0
    last: float = -1.0
    off: tuple[float, float] = (0.0, 0.0)

    def velocity(
        self, true: tuple[float, float] | None, noise: PerceptNoise, dt: float
    ) -> tuple[tuple[float, float], float]:
        """A noisy velocity and its standard deviation; 0 if not known."""
        keep = float(np.exp(-dt / noise.velocity_tau_s))
        x, y = np.sqrt(1 - keep**2) * self.rng.standard_normal(2) + keep * np.array(self.off)
        self.off = (float(x), float(y))
        if true is None or noise.velocity <= 0.0:
            return (0.0, 0.0), 0.0
        sigma = float(noise.velocity + noise.velocity_share * np.hypot(*true))
        return (true[0] + sigma * self.off[0], true[1] + sigma * self.off[1]), sigma


@dataclass(slots=True)
class SimulatedSegmenter:
    """A behaviour that reports the regions of a mission.

    Attributes:
        mission: The mission.
        noise: The errors.
        true_names: Region id -> names of the true objects that it shows, filled during reporting.
    """

    mission: Mission
    noise: PerceptNoise = field(default_factory=PerceptNoise)
    true_names: dict[int, tuple[str, ...]] = field(default_factory=dict, init=False)
    contract: Contract = field(default=Contract("truth", gives=("region", "health")), init=False)
    _noise_states: dict[str, _ObjectNoise] = field(default_factory=dict, init=False)
    _coupled: tuple[tuple[float, frozenset[str]], ...] = field(default=(), init=False)

    def __post_init__(self) -> None:
        seeds = np.random.SeedSequence([self.noise.seed, 1]).spawn(
            len(self.mission.truth["labels"])
        )
        n, dt = self.noise, 1.0 / self.mission.fps
        for name, seed in zip(sorted(self.mission.truth["labels"]), seeds, strict=True):
            rng = np.random.default_rng(seed)
            contour = ContourNoise(
                n.contour_px, n.contour_length_px, n.contour_tau_s, self.mission.size, rng
            )
            self._noise_states[name] = _ObjectNoise(contour, Dropouts(n, dt, rng), rng)
        self._coupled = tuple(
            (e["frame"] / self.mission.fps, frozenset(e["objects"]))
            for e in self.mission.truth["events"]
            if e["kind"] == "coupled"
        )

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report one frame; see `Behaviour`."""
        yield Percept("health", Health(HealthStatus.OK), frame.time, "truth")
        for names, mask in self._groups(frame).items():
            state = self._noise_states[names[0]]
            if int(np.count_nonzero(mask)) < self.noise.min_visible_px or state.gaps.missing():
                continue
            true = self.mission.masks[frame.index][names[0]].velocity
            # Motion is measured between frames: it is unknown for regions missing in the last ones.
            known = true if frame.time - state.last < 0.1 else None
            velocity, sigma = state.velocity(known, self.noise, 1.0 / self.mission.fps)
            number = self._number(names, frame.time)
            region = replace(
                region_of(mask, number, velocity), velocity_sigma=sigma, confidence=CONFIDENCE
            )
            self.true_names[region.id] = names
            yield Percept("region", region, frame.time, "truth", region.confidence)

    def _groups(self, frame: Frame) -> dict[tuple[str, ...], NDArray[np.bool_]]:
        """Whole-image masks; a pixel in several of them belongs to the one that it is deepest inside."""
        width, height = self.mission.size
        deepest = np.zeros((height, width), np.float32)
        owner = np.full((height, width), -1, np.int8)
        names = list(self.mission.masks[frame.index])
        for k, name in enumerate(names):
            mask, state = self.mission.masks[frame.index][name], self._noise_states[name]
            (x, y), shape = mask.at, mask.inside.shape
            depth = displaced_distance(
                mask, state.contour.at(frame.time, mask.at, (shape[0], shape[1]))
            )
            part = (slice(y, y + shape[0]), slice(x, x + shape[1]))
            closer = depth > deepest[part]
            deepest[part][closer] = depth[closer]
            owner[part][closer] = k
        return {
            group: np.isin(owner, [names.index(n) for n in group])
            for group in self._grouped(names, frame.time)
        }

    def _grouped(self, names: list[str], time: float) -> list[tuple[str, ...]]:
        merged = [c for t, c in self._coupled if self.noise.merge_coupled and time >= t]
        groups = {next((c for c in merged if n in c), frozenset({n})) for n in names}
        return sorted(tuple(n for n in sorted(g) if n in names) for g in groups)

    def _number(self, names: tuple[str, ...], time: float) -> int:
        """The id that a tracker would give."""
        state = max((self._noise_states[n] for n in names), key=lambda s: (s.last, s.number))
        fresh = not state.number or time - state.last > self.noise.fresh_id_s
        number = max(s.number for s in self._noise_states.values()) + 1 if fresh else state.number
        for name in names:
            self._noise_states[name].number, self._noise_states[name].last = number, time
        return number


@dataclass(slots=True)
class SimulatedRecogniser:
    """A behaviour that reports hypotheses and depth of each region.

    Attributes:
        segmenter: The behaviour that reports the regions.
    """

    segmenter: SimulatedSegmenter
    contract: Contract = field(init=False)
    _sources: dict[str, HypothesisSource] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        noise, mission = self.segmenter.noise, self.segmenter.mission
        self.contract = Contract(
            "truth_names", ("hypothesis", "depth"), ("region",), noise.names_every_s
        )
        run = max(1.0, noise.wrong_run_s / noise.names_every_s)
        naming = NamingNoise(noise.wrong, run, noise.listed, noise.depth)
        seeds = np.random.SeedSequence([noise.seed, 2]).spawn(len(mission.truth["labels"]))
        for name, seed in zip(sorted(mission.truth["labels"]), seeds, strict=True):
            rng = np.random.default_rng(seed)
            self._sources[name] = HypothesisSource(mission, name, naming, rng)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report one frame; see `Behaviour`."""
        for region in observation.of("region"):
            for value in self._reports(region, frame.index):
                kind = "hypothesis" if isinstance(value, Hypothesis) else "depth"
                yield Percept(kind, value, frame.time, "truth_names")

    def _reports(self, region: Region, index: int) -> Iterator[Hypothesis | Depth]:
        masks = self.segmenter.mission.masks[index]
        names = self.segmenter.true_names[region.id]
        # A region of two bodies is taken for the larger one, or for any other model.
        name = max(names, key=lambda n: masks[n].visible_px if n in masks else 0)
        yield from self._sources[name].report(region, index, alone=len(names) == 1)


def behaviours_of(
    mission: Mission, noise: PerceptNoise
) -> tuple[list[Behaviour], Mapping[int, tuple[str, ...]]]:
    """Behaviours that report a mission's ground truth with noise.

    Returns:
        The behaviours for an agent; and region id -> names of true objects, filled while it runs.
    """
    segmenter = SimulatedSegmenter(mission, noise)
    return [segmenter, SimulatedRecogniser(segmenter)], segmenter.true_names


def frames_of(mission: Mission, *, every: int = 1) -> Iterator[Frame]:
    """Blank frames, for behaviours that read the ground truth."""
    width, height = mission.size
    blank = np.broadcast_to(np.zeros((1, 1, 1), np.uint8), (height, width, 3))
    for row in mission.truth["frames"][::every]:
        yield Frame(row["index"], row["index"] / mission.fps, blank)


def observations_of(
    mission: Mission, noise: PerceptNoise, *, every: int = 1
) -> Iterator[tuple[Observation, dict[int, tuple[str, ...]]]]:
    """Simulated observations, each with the truth: region id -> names of true objects."""
    behaviours, true_names = behaviours_of(mission, noise)
    slots = ordered_slots(behaviours)
    for frame in frames_of(mission, every=every):
        observation = perceive(slots, frame, ())
        yield observation, {r.id: true_names[r.id] for r in observation.of("region")}
