"""`visup eval reasoning`: rules and tasks on percepts simulated from the truth of missions.

Perception is replaced by simulation with known noise (`PerceptNoise`), to evaluate reasoning alone:
identities, events, and the state of the task.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import Frame, Mind, ObjectBelief, Presence
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.step import Step
from visup.evaluation.calibration import Calibration
from visup.evaluation.figures import Progress, silent
from visup.evaluation.missions.files import mission_folders
from visup.evaluation.missions.overlaps import MIN_COVERING_IOU, MIN_SCORED_PX
from visup.evaluation.missions.pose_errors import true_spin
from visup.evaluation.missions.recorder import MissionRecorder
from visup.evaluation.missions.runner import mission_total, report_scores
from visup.evaluation.missions.scores import UNSCORED_START_S, MissionTruth, parse_truth
from visup.evaluation.simulation.percepts import PerceptNoise, behaviours_of, frames_of
from visup.evaluation.simulation.truth_masks import Mission, TrueMask, load_mission
from visup.evaluation.workers import worker_pool
from visup.rules.reasoners import default_reasoners
from visup.tasks import load_task
from visup.tasks.supervision.supervise import task_reasoner

SPIN_WINDOW_S = 5.0
"""Rotation is scored over this time at the end of a mission, seconds."""


@dataclass(slots=True)
class BeliefScorer:
    """Scores the beliefs about one mission, frame by frame.

    Attributes:
        mission: The mission with its truth.
        truths: The parsed truth.
        true_names: Region id -> names of true objects.
        recorder: Recorded events, alerts, stages.
        correct: Number of object-frames with the correct name.
        scored: Number of all scored object-frames.
        calibration: Confidences with correctness.
        overlap_frames: (object, true name) -> frames in which its region showed that.
        spins: (time, degrees per second) believed for each true object.
        misidentified: Frames with a wrong name: (time, object, belief).
    """

    mission: Mission
    truths: MissionTruth
    true_names: Mapping[int, tuple[str, ...]]
    recorder: MissionRecorder = field(default_factory=MissionRecorder)
    correct: int = 0
    scored: int = 0
    calibration: Calibration = field(default_factory=Calibration)
    overlap_frames: dict[tuple[int, str], int] = field(default_factory=dict)
    spins: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    misidentified: list[tuple[float, str, str]] = field(default_factory=list)

    def __call__(self, step: Step, frame: Frame) -> None:
        """Add one step; an observer."""
        self.recorder(step, frame)
        for known in step.mind.objects.values():
            names = self.true_names.get(known.region.id, ())
            if known.last_seen == step.time and len(names) == 1:
                key = (known.id, names[0])
                self.overlap_frames[key] = self.overlap_frames.get(key, 0) + 1
        for name, masks in self._scored(step):
            belief = covering(step.mind, masks)
            believed = "nobody" if belief is None else belief.name
            accepted = {self.truths.names[n] for n in self._coupled_with(name, step.time)}
            correct = believed in accepted
            self.scored += 1
            self.correct += correct
            if not correct:
                self.misidentified.append((step.time, name, believed))
            if belief is not None:
                self.calibration.add(belief.confidence, correct)
                if belief.pose is not None and belief.pose.spin is not None:
                    spin = (step.time, belief.pose.spin.rate)
                    self.spins.setdefault(name, []).append(spin)

    def names(self) -> dict[int, str]:
        """Id of a believed object -> true object that it showed most often."""
        ranked = sorted(self.overlap_frames.items(), key=lambda item: (item[1], item[0]))
        return {number: name for (number, name), _ in ranked}

    def _coupled_with(self, name: str, time: float) -> frozenset[str]:
        """The true objects coupled to this one now, including itself."""
        for event in self.truths.events:
            if event.kind == "coupled" and name in event.objects and time >= event.time:
                return event.objects
        return frozenset({name})

    def _scored(self, step: Step) -> Iterator[tuple[str, list[list[TrueMask]]]]:
        """The scored objects of this frame, with the masks that may match them."""
        masks = self.mission.masks[step.frame_index]
        for name, mask in masks.items():
            entry_times = [
                e.time for e in self.truths.events if e.kind == "entry" and name in e.objects
            ]
            entry_is_past = bool(entry_times) and step.time >= min(entry_times) + UNSCORED_START_S
            if mask.visible_px < MIN_SCORED_PX or not entry_is_past:
                continue
            union = [masks[n] for n in sorted(self._coupled_with(name, step.time)) if n in masks]
            yield name, [[mask], union] if len(union) > 1 else [[mask]]


def covering(mind: Mind, masks: Sequence[Sequence[TrueMask]]) -> ObjectBelief | None:
    """The believed object at the position of a true one.

    Args:
        mind: The mind; hidden objects count at their believed positions.
        masks: Masks of the true object, and of all objects coupled to it.

    Returns:
        The belief with the best IoU with one of these, or None if below 0.5.
    """
    scored = [
        (max(_iou(b, parts) for parts in masks), -b.id, b)
        for b in mind.objects.values()
        if b.presence is not Presence.LEFT or b.last_seen == mind.time
    ]
    best = max(scored, default=None, key=lambda s: s[:2])
    return best[2] if best is not None and best[0] >= MIN_COVERING_IOU else None


def _iou(belief: ObjectBelief, parts: Sequence[TrueMask]) -> float:
    x, y, w, h = belief.region.bbox
    intersection = 0
    for true in parts:
        rows, columns = true.inside.shape
        left, top = max(x, true.at[0]), max(y, true.at[1])
        right, bottom = min(x + w, true.at[0] + columns), min(y + h, true.at[1] + rows)
        if left < right and top < bottom:
            believed = belief.region.mask[top - y : bottom - y, left - x : right - x]
            at = true.at
            inside = true.inside[top - at[1] : bottom - at[1], left - at[0] : right - at[0]] > 0
            intersection += int(np.count_nonzero(believed & inside))
    true_px = sum(true.visible_px for true in parts)
    return intersection / max(1.0, belief.region.area + true_px - intersection)


def watch_mission(mission: Mission, noise: PerceptNoise, *, every: int = 1) -> BeliefScorer:
    """Supervise one mission on simulated percepts."""
    behaviours, true_names = behaviours_of(mission, noise)
    scorer = BeliefScorer(mission, parse_truth(mission.truth, mission.fps), true_names)
    rules = default_reasoners()
    task = task_reasoner([load_task(str(mission.description["task"]))])
    agent = Agent(
        behaviours=behaviours,
        reasoners=Reasoners(rules.update, rules.cogitate, (task,)),
        actors={a: (m,) for a, m in mission.description["actors"].items()},
        observers=(scorer,),
    )
    agent.run(frames_of(mission, every=every))
    return scorer


def run_scores(scorer: BeliefScorer) -> dict[str, Any]:
    """Figures of one run."""
    names = scorer.names()
    reported = [(kind, ids) for kind, ids, _ in scorer.recorder.events]
    true_events = {(e.kind, e.objects) for e in scorer.truths.events}

    def false(kind: str) -> int:
        return sum(
            (k, frozenset(names.get(i, "?") for i in ids)) not in true_events
            for k, ids in reported
            if k == kind
        )

    return {
        "identity_counts": [scorer.correct, scorer.scored],
        "calibration": scorer.calibration.counts(),
        "false_coupled": false("coupled"),
        "false_exit": false("exit"),
        "spin_errors": _spin_errors(scorer),
        **report_scores(scorer.truths, scorer.recorder, names),
    }


def _spin_errors(scorer: BeliefScorer) -> list[float]:
    """Relative errors of the satellite's believed rotation rate at the end of a mission.

    The reference is its true rotation then: a captured satellite turns with its carrier.
    """
    end = scorer.recorder.last.time if scorer.recorder.last else 0.0
    recent = [(t, r) for t, r in scorer.spins.get("satellite", []) if t > end - SPIN_WINDOW_S]
    rates = [
        (r, true_spin(scorer.mission.truth, _frame_index(scorer, t), "satellite"))
        for t, r in recent
    ]
    pairs = [(reported, true) for reported, true in rates if true is not None]
    if not pairs:
        return []
    reported, true = np.median(np.array(pairs), axis=0).tolist()
    return [abs(reported - true) / true] if true > 0 else []


def _frame_index(scorer: BeliefScorer, time: float) -> int:
    return round(time * scorer.mission.fps)


def evaluate_reasoning(
    folder: Path,
    *,
    seeds: int = 20,
    first: int = 0,
    every: int = 1,
    jobs: int = 2,
    noise: PerceptNoise | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Figures over all missions below a folder, each simulated with several noise seeds.

    Args:
        folder: A mission, or a folder of missions.
        seeds: Number of runs of each mission.
        first: The first seed.
        every: Use every n-th frame.
        jobs: Number of processes.
        noise: Noise of percepts; its seed is not used.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {mission: {...}}}; counts are summed over the seeds.

    Raises:
        SettingsError: There is no mission, or one cannot be read.
    """
    missions = mission_folders(folder)
    noise = noise or PerceptNoise()
    run = partial(_mission, every=every, noise=noise)
    # Each run has its own random seed.
    seeds_by_mission = [
        [seed * len(missions) + k for seed in range(first, first + seeds)]
        for k in range(len(missions))
    ]
    runs: dict[str, list[dict[str, Any]]] = {}
    with worker_pool(jobs) as pool:
        for mission, mission_runs in zip(
            missions, pool.map(run, missions, seeds_by_mission), strict=True
        ):
            runs[mission.name] = mission_runs
            progress(mission.name)
    items = {name: _summed(mission_runs) for name, mission_runs in runs.items()}
    return {
        "total": _summed([r for mission_runs in runs.values() for r in mission_runs]),
        "items": items,
    }


def _mission(
    folder: Path, seeds: Sequence[int], every: int, noise: PerceptNoise
) -> list[dict[str, Any]]:
    mission = load_mission(folder, every=every)
    return [
        run_scores(watch_mission(mission, replace(noise, seed=seed), every=every)) for seed in seeds
    ]


def _summed(runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Figures of several runs from summed counts."""
    total = mission_total([{k: v for k, v in r.items() if v is not None} for r in runs])
    calibration = Calibration()
    for run in runs:
        calibration.join(run["calibration"])
    spins = [e for r in runs for e in r["spin_errors"]]
    total |= {k: sum(r[k] for r in runs) for k in ("false_coupled", "false_exit")}
    total |= {"runs": len(runs), "ece": calibration.error(), "reliability": calibration.table()}
    return total | ({"spin_error": float(np.median(spins))} if spins else {})
