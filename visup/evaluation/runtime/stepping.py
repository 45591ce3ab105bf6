"""`visup eval stepping`: cost, memory and correctness of stepping back.

Three ellipses that move, meet and separate, all reasoning, one task. Every region has its own mask and
outline, like perceived regions.
"""

from __future__ import annotations

import gc
import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, Observation, Region
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.checkpoint import dump_state
from visup.evaluation.figures import Progress, resident_mb, silent
from visup.evaluation.runtime.scripted_observations import moving_ellipses
from visup.rules.relations.reasoner import RELATIONS
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.stepping import ScriptedObservations, Stepper

BACK_STEPS = 500
MAX_BACK_MS = 200.0
MAX_KEPT_MB = 200.0
REFERENCE_STEPS = 10_000
MIN_STEPS = 1000
BLOCK = 50  # steps made alternately with and without a stepper
BLOCKS = 12
VISITS = 30
WARM_UP_STEPS = 100
DIGEST_INTERVAL = 50  # interval of steps whose digests are compared


def evaluate_stepping(
    steps: int = REFERENCE_STEPS, *, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """Measure a long timeline.

    Args:
        steps: Number of steps.
        seed: Random seed of the positions.
        progress: Shows what is being done.

    Returns:
        `items` for going 'back' by `BACK_STEPS` steps, for reading an earlier step without going there
        ('look'), and for starting a 'branch' `BACK_STEPS` steps ago: `median_ms` and `most_ms` of processor
        time; `total` with `steps`, `kept_mb` (growth of the process, for 10,000 steps), `same` (share of
        positions at which the steps after going back equal those before byte for byte), and `slower`
        (processor time of a step by a stepper, relative to that of the agent alone).

    Raises:
        SettingsError: There are too few steps.
    """
    if steps < MIN_STEPS:
        raise SettingsError(f"--steps is {steps}", expected=f"at least {MIN_STEPS}")
    progress("by itself and stepped, in turn")
    slower = _relative_step_time()
    stepper = _stepper(steps + 10)
    digests, grown_mb = _fill_timeline(stepper, steps, progress)
    progress("going back")
    items, same = _measure_visits(
        stepper, np.random.default_rng(seed).integers(BACK_STEPS + 1, steps, VISITS), digests
    )
    total = {
        "steps": steps,
        "kept_mb": grown_mb * REFERENCE_STEPS / (steps - WARM_UP_STEPS),
        "same": float(np.mean(same)),
        "slower": slower,
    }
    return {"items": items, "total": total}


def _fill_timeline(
    stepper: Stepper, steps: int, progress: Progress
) -> tuple[dict[int, bytes], float]:
    """Digests of every 50th step, and growth of memory, MB."""
    digests: dict[int, bytes] = {}
    stepper.step(WARM_UP_STEPS)
    gc.collect()
    before = resident_mb()
    while stepper.at < steps:
        step = stepper.step(DIGEST_INTERVAL).step
        assert step is not None
        digests[stepper.at] = _digest(step)
        if stepper.at % 1000 == 0:
            progress(f"{stepper.at} of {steps} steps")
    gc.collect()
    return digests, resident_mb() - before


def _measure_visits(
    stepper: Stepper, positions: NDArray[np.int64], digests: dict[int, bytes]
) -> tuple[dict[str, dict[str, float]], list[bool]]:
    """Times of going back, looking and branching from these steps; whether the following steps are equal."""
    back, look, branch, same = [], [], [], []
    for position in map(int, positions):
        stepper.go(position)
        back.append(_ms(lambda: stepper.back(BACK_STEPS)))
        digest_position = -(-stepper.at // DIGEST_INTERVAL) * DIGEST_INTERVAL
        step = stepper.go(max(digest_position, WARM_UP_STEPS + DIGEST_INTERVAL))
        same.append(step is not None and _digest(step) == digests[stepper.at])
        stepper.go(position)
        look.append(_ms(partial(stepper.at_step, position - BACK_STEPS)))
        stepper.back(BACK_STEPS)
        branch.append(_ms(lambda: stepper.branch().step(1)))
    return {"back": _times(back), "look": _times(look), "branch": _times(branch)}, same


def missed_bars(figures: dict[str, Any]) -> list[str]:
    """The bars that figures miss, one sentence each."""
    back_ms, kept_mb = figures["items"]["back"]["most_ms"], figures["total"]["kept_mb"]
    missed = (
        [f"back({BACK_STEPS}) took {back_ms:.0f} ms, the bar is {MAX_BACK_MS:g}"]
        if back_ms > MAX_BACK_MS
        else []
    )
    if kept_mb > MAX_KEPT_MB:
        missed.append(f"{REFERENCE_STEPS} steps keep {kept_mb:.0f} MB, the bar is {MAX_KEPT_MB:g}")
    if figures["total"]["same"] < 1.0:
        missed.append("steps after going back differ from those before")
    return missed


def _stepper(steps: int) -> Stepper:
    return Stepper(
        _agent(),
        ScriptedObservations(_with_own_arrays(o) for o in moving_ellipses(steps)),
    )


def _agent() -> Any:
    return reasoning_agent(WatchSettings("scripted", tasks=("dock",)))


def _with_own_arrays(observation: Observation) -> Observation:
    """The same with masks and outlines of its own."""

    def owned(value: object) -> object:
        if not isinstance(value, Region):
            return value
        return replace(value, mask=value.mask.copy(), contour=value.contour.copy())

    reports = tuple(
        replace(r, percepts=tuple(replace(p, value=owned(p.value)) for p in r.percepts))
        for r in observation.reports
    )
    return replace(observation, reports=reports)


def _relative_step_time() -> float:
    """Short blocks with and without alternate, so that other load affects both."""
    agent, stepper = _agent(), _stepper((BLOCKS + 1) * BLOCK)
    frames: Iterator[Observation] = (
        _with_own_arrays(observation) for observation in moving_ellipses((BLOCKS + 1) * BLOCK)
    )
    alone, stepped = [], []
    for _ in range(BLOCKS + 1):
        block = [next(frames) for _ in range(BLOCK)]
        begin = time.process_time()
        for observation in block:
            agent.reason(observation)
        middle = time.process_time()
        stepper.step(BLOCK)
        alone.append(middle - begin)
        stepped.append(time.process_time() - middle)
    generation_s = _generation_time()
    return float((np.percentile(stepped[1:], 25) - generation_s) / np.percentile(alone[1:], 25))


def _generation_time() -> float:
    """Processor time for generating a block of percepts, to be subtracted."""
    seconds = []
    for _ in range(5):
        begin = time.process_time()
        for observation in moving_ellipses(BLOCK):
            _with_own_arrays(observation)
        seconds.append(time.process_time() - begin)
    return float(np.percentile(seconds, 25))


def canonical_mind(mind: Mind) -> Mind:
    """The same mind with its samples in canonical memory layout, which is no part of the beliefs."""
    memory = mind.recall(RELATIONS)
    return mind.remember(RELATIONS, replace(memory, history=replace(memory.history, start=0)))


def _digest(step: Step) -> bytes:
    return hashlib.sha256(
        dump_state((step.mind.objects, canonical_mind(step.mind).memory, step.events, step.alerts))
    ).digest()


def _ms(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return (time.process_time() - begin) * 1e3


def _times(times: list[float]) -> dict[str, float]:
    return {"median_ms": float(np.median(times)), "most_ms": max(times)}
