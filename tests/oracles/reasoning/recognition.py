"""Recognition against its exact oracle, on large tasks seen badly, and by the clock.

Bars: the same most likely stage and status as the oracle and probabilities within 1e-6 on 2,000
small random grammars; stages as supervision tells them within 0.05 of the certified posterior on
average, on random grammars with observations that follow no course; the right stage at 95 % of steps
of random tasks of 30 stages with alternatives and loops when a fifth of what is seen is wrong; 2,000
steps/s at 50 stages, growing no worse than linearly to 500.
"""

from __future__ import annotations

import random
import statistics
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from tests.oracles import recognition_oracle, recognition_tasks
from visup.evaluation.figures import Progress, silent
from visup.evaluation.reasoning.filter_laws import MAX_MEAN_DIFFERENCE, random_grammar_distance
from visup.tasks.automaton.automaton import END
from visup.tasks.automaton.hidden_phases import (
    ActionEvidence,
    ActionKey,
    HiddenFilter,
    HiddenPosterior,
    hidden_filter,
)
from visup.tasks.automaton.stage_hmm import ActionStatus, StageHmm
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.parser import read

MAX_HISTORIES = 4_000
LONGEST = 6
TOLERANCE = 1e-6
FRAME_S = 0.1
WRONG = 0.2
MEANS_S = (3.0, 6.0, 12.0)
"""Mean durations of stages. A change of stage shows after a few frames: it takes a larger part of
short stages."""
SCORED_MEAN_S = 6.0
UNPRUNED_STEPS = 600
GRAMMARS_A_LAW = 50  # one in so many grammars is followed with every history by itself
CLOCK_SLACK = 1.2  # two timings of the same work may differ so far


@dataclass
class Agreement:
    """How far recogniser and oracle agree.

    Attributes:
        grammars: How many were compared.
        steps: At how many steps.
        worst: Greatest difference of two probabilities.
        worst_success: Greatest difference of the probabilities to end well.
        other: Seeds at which the most likely stage and status differ, and are no tie.
    """

    grammars: int = 0
    steps: int = 0
    worst: float = 0.0
    worst_success: float = 0.0
    other: list[int] = field(default_factory=list)


def compare(count: int, first: int = 0) -> Agreement:
    """Compare the recogniser with the oracle on random grammars and streams.

    Args:
        count: How many grammars.
        first: Seed of the first; one more for each.
    """
    result = Agreement()
    for seed in range(first, first + count):
        _compare(random.Random(seed), seed, result)
    return result


def _compare(rng: random.Random, seed: int, result: Agreement) -> None:
    draw = recognition_tasks.Draw(rng)
    rules, model = draw.rules(), drawn_process(rng)
    stream = draw.stream(LONGEST)
    oracle = recognition_oracle.Oracle(rules, model)
    recogniser = hidden_filter(read(recognition_tasks.text_of(rules)), model, most=10**9, least=0.0)
    belief = recogniser.start()
    result.grammars += 1
    for (dt, seen), truth in zip(stream, oracle.told(stream, MAX_HISTORIES), strict=False):
        belief = recogniser.step(belief, evidence(seen), dt)
        told = {(stage, str(s)): p for (stage, s), p in recogniser.stages(belief).items()}
        differ = (abs(told.get(k, 0.0) - truth.get(k, 0.0)) for k in {*told, *truth})
        result.worst = max(result.worst, *differ)
        result.steps += 1
        best = max(told, key=lambda k: told[k])
        if truth.get(best, 0.0) < max(truth.values()) - TOLERANCE:
            result.other.append(seed)
    good, open_end = oracle.hopes()
    hoped = recogniser.success(recogniser.start())
    result.worst_success = max(result.worst_success, good - hoped, hoped - good - open_end)


def drawn_process(rng: random.Random) -> StageHmm:
    """A model whose numbers are drawn too: what is compared is the arithmetic, not the numbers."""
    return StageHmm(
        begin=rng.uniform(0.2, 3.0),
        leave=rng.uniform(0.05, 2.0),
        skip=rng.uniform(0.0, 0.1),
        fail=rng.uniform(0.0, 0.3),
        recover=rng.uniform(0.0, 0.5),
        lose=rng.uniform(0.01, 0.2),
        missing=rng.uniform(0.02, 0.4),
        spurious=rng.uniform(0.02, 0.3),
        phases=rng.choice((1, 2, 3)),
    )


def evidence(seen: Mapping[str, tuple[str, float]]) -> dict[ActionKey, ActionEvidence]:
    """What a drawn stream tells, as the recogniser takes it."""
    return {
        (key, ("o",) if key == recognition_oracle.OPTIONAL else ("x",)): ActionEvidence(
            ActionStatus[what.upper()], sure
        )
        for key, (what, sure) in seen.items()
    }


@dataclass(frozen=True)
class SimulatedRun:
    """One way in which a task truly went, and what was seen of it.

    Attributes:
        stages: The stage that is truly under way at each step; empty when the task is over.
        seen: What is seen at each step.
    """

    stages: tuple[str, ...]
    seen: tuple[Mapping[ActionKey, ActionEvidence], ...]


def simulate_run(
    task: Task, rng: random.Random, mean_s: float, wrong: float = WRONG, most: int = 10**6
) -> SimulatedRun:
    """Let a task run its course: stages in a legal order, each as long as chance has it.

    Args:
        task: The task.
        rng: The chance.
        mean_s: How long stages take on average, seconds; each from half to one and a half of it.
        wrong: Share of verdicts that are wrong: each of the two others alike.
        most: No more than so many steps, whether or not the task is over.
    """
    automaton = hidden_filter(task).automaton
    keys = sorted(
        {(s.action, s.actors) for n in automaton.explored(10**6) for s in automaton.steps(n)}
    )
    stages: list[str] = []
    seen: list[Mapping[ActionKey, ActionEvidence]] = []
    node = rng.choice(automaton.start)[0]
    while node != END and len(stages) < most:
        (step,) = automaton.steps(node)
        for _ in range(round(mean_s * rng.uniform(0.5, 1.5) / FRAME_S)):
            stages.append(step.stage)
            seen.append({k: _verdict(k == (step.action, step.actors), rng, wrong) for k in keys})
        node = rng.choice(automaton.transitions(node)).target
    return SimulatedRun(tuple(stages), tuple(seen))


SURE = {s: ActionEvidence(s) for s in ActionStatus}
WRONGLY = {
    ActionStatus.HOLDS: (SURE[ActionStatus.NEITHER], SURE[ActionStatus.CONTRARY]),
    ActionStatus.NEITHER: (SURE[ActionStatus.HOLDS], SURE[ActionStatus.CONTRARY]),
}


def _verdict(going: bool, rng: random.Random, wrong: float) -> ActionEvidence:
    true = ActionStatus.HOLDS if going else ActionStatus.NEITHER
    return rng.choice(WRONGLY[true]) if rng.random() < wrong else SURE[true]


@dataclass(frozen=True)
class TrackingResult:
    """How well one task was followed.

    Attributes:
        right: Share of steps at which the likeliest stage is the one truly under way.
        steps: How many steps.
        kept: Places kept on average.
        lost: The account of what was dropped.
        differs: Share of steps at which the likeliest stage is another one without any dropping.
        dropped_truth: At how many steps the true stage had no place left at all.
    """

    right: float
    steps: int
    kept: float
    lost: float
    differs: float
    dropped_truth: int


def follow(stages: int, seed: int, mean_s: float) -> TrackingResult:
    """Follow a random task of so many stages and compare with the truth, and with no pruning."""
    rng = random.Random(seed)
    task = read(recognition_tasks.large_task(stages, rng))
    played = simulate_run(task, rng, mean_s)
    pruned, whole = hidden_filter(task), hidden_filter(task, most=10**9, least=0.0)
    told = list(_beliefs(pruned, played))
    said = [pruned.ranking(b) for b in told]
    # Without pruning every place is worked out at every step, which takes a while.
    some = SimulatedRun(played.stages[:UNPRUNED_STEPS], played.seen[:UNPRUNED_STEPS])
    exact = [whole.ranking(b)[0][0] for b in _beliefs(whole, some)]
    count = len(said)
    return TrackingResult(
        right=sum(r[0][0] == s for r, s in zip(said, played.stages, strict=True)) / count,
        steps=count,
        kept=statistics.fmean(len(b.hypotheses) for b in told),
        lost=told[-1].lost,
        differs=sum(r[0][0] != s for r, s in zip(said, exact, strict=False)) / len(exact),
        dropped_truth=sum(s not in dict(r) for r, s in zip(said, played.stages, strict=True)),
    )


def _beliefs(recogniser: HiddenFilter, played: SimulatedRun) -> Iterator[HiddenPosterior]:
    belief = recogniser.start()
    for i, seen in enumerate(played.seen):
        belief = recogniser.step(belief, seen, FRAME_S if i else 0.0)
        yield belief


def speed(stages: int, seed: int = 0, steps: int = 2_000) -> float:
    """Steps per second of processor time at a task of so many stages, with telling what is believed.

    The nodes of the automaton are worked out while the clock runs, as they are in use.
    """
    rng = random.Random(seed)
    task = read(recognition_tasks.large_task(stages, rng))
    seen = simulate_run(task, rng, 4.0, most=steps).seen[:steps]
    recogniser = hidden_filter(task)
    begin = time.process_time()
    belief = recogniser.start()
    for i, now in enumerate(seen):
        belief = recogniser.step(belief, now, FRAME_S if i else 0.0)
        recogniser.most_likely(belief)
    return len(seen) / (time.process_time() - begin)


def speed_unsure(stages: int, steps: int = 200) -> float:
    """Steps per second when nothing at all is seen of rows of ten stages, one of which is taken."""
    rows = [" ".join(f"act_{i}(x)" for i in range(n, n + 10)) for n in range(0, stages, 10)]
    recogniser = hidden_filter(read(f"<t> ::= {' | '.join(rows)}"))
    belief = recogniser.start()
    begin = time.process_time()
    for i in range(steps):
        belief = recogniser.step(belief, {}, FRAME_S if i else 0.0)
        recogniser.most_likely(belief)
    return steps / (time.process_time() - begin)


def evaluate_recognition(
    grammars: int = 2_000,
    tasks: int = 20,
    first: int = 0,
    progress: Progress = silent,
) -> tuple[dict[str, Any], dict[str, bool]]:
    """All figures of recognition, and whether each bar is held.

    Args:
        grammars: How many small grammars are compared with the oracle.
        tasks: How many large tasks are followed.
        first: The first seed.
        progress: Shows what is being done.
    """
    progress("comparing with the oracle")
    agreed = compare(grammars, first)
    figures: dict[str, Any] = {
        "grammars": agreed.grammars,
        "steps_compared": agreed.steps,
        "worst_difference": agreed.worst,
        "worst_difference_of_success": agreed.worst_success,
        "other_stage_or_status": len(agreed.other),
    }
    progress("comparing supervision with every history by itself")
    figures |= _supervised(max(1, grammars // GRAMMARS_A_LAW), first)
    for mean_s in MEANS_S:
        progress(f"following tasks with stages of {mean_s:g} s")
        figures |= _followed(tasks, first, mean_s)
    progress("by the clock")
    for stages in (50, 500):
        figures[f"steps_per_s_{stages}"] = round(speed(stages))
        figures[f"steps_per_s_{stages}_unsure"] = round(speed_unsure(stages))
    return figures, _held(figures)


def _supervised(grammars: int, first: int) -> dict[str, Any]:
    """How far supervision is from certified, over random grammars."""
    found = [random_grammar_distance(seed) for seed in range(first, first + grammars)]
    return {
        "supervised_grammars": grammars,
        "supervision_differs_worst": max(d.worst for d in found),
        "supervision_differs_mean": statistics.fmean(d.mean for d in found),
        "certified_lost_at_most": max(d.lost for d in found),
    }


def _followed(tasks: int, first: int, mean_s: float) -> dict[str, Any]:
    runs = [follow(30, seed, mean_s) for seed in range(first, first + tasks)]
    steps = sum(r.steps for r in runs)
    mark = f"_{mean_s:g}s"
    return {
        f"right_stage{mark}": round(sum(r.right * r.steps for r in runs) / steps, 4),
        f"places_kept{mark}": round(statistics.fmean(r.kept for r in runs), 1),
        f"lost_at_most{mark}": max(r.lost for r in runs),
        f"pruned_otherwise{mark}": round(sum(r.differs * r.steps for r in runs) / steps, 6),
        f"truth_without_place{mark}": sum(r.dropped_truth for r in runs) / steps,
    }


def _held(figures: Mapping[str, Any]) -> dict[str, bool]:
    """The bars, by name."""
    growth = figures["steps_per_s_50"] / figures["steps_per_s_500"]
    unsure = figures["steps_per_s_50_unsure"] / figures["steps_per_s_500_unsure"]
    worst = max(figures["worst_difference"], figures["worst_difference_of_success"])
    return {
        "as the oracle": worst <= TOLERANCE and figures["other_stage_or_status"] == 0,
        "supervision as certified": figures["supervision_differs_mean"] <= MAX_MEAN_DIFFERENCE,
        "right stage": figures[f"right_stage_{SCORED_MEAN_S:g}s"] >= 0.95,
        "2,000 steps/s at 50 stages": figures["steps_per_s_50"] >= 2_000,
        "linear to 500 stages": max(growth, unsure) <= 10 * CLOCK_SLACK,
    }
