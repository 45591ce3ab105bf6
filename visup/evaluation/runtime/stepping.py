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

BACK = 500
BACK_MS = 200.0
KEPT_MB = 200.0
KEPT_STEPS = 10_000
LEAST_STEPS = 1000
BLOCK = 50  # steps made alternately with and without a stepper
BLOCKS = 12
VISITS = 30
WARM = 100
EVERY = 50  # interval of steps whose digests are compared


def evaluate_stepping(
    steps: int = KEPT_STEPS, *, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """Measure a long timeline.

    Args:
        steps: Number of steps.
        seed: Random seed of the positions.
        progress: Shows what is being done.

    Returns:
        `items` for going 'back' (by `BACK` steps, from anywhere), for `step` number n told without
        going there ('look'), and for a 'branch' that is begun `BACK` steps ago: `median_ms` and
        `most_ms` of processor time; `total` with `steps`, `kept_mb` (by how much the process has grown
        over all steps, for 10,000 of them), `same` (the share of places at which the steps after
        going back were byte for byte those before), and `slower` (processor time of a step made by
        a stepper, by that of the agent alone).

    Raises:
        SettingsError: There are too few steps.
    """
    if steps < LEAST_STEPS:
        raise SettingsError(f"--steps is {steps}", expected=f"at least {LEAST_STEPS}")
    progress("by itself and stepped, in turn")
    slower = _slower()
    stepper = _stepper(steps + 10)
    digests, grown_mb = _stepped(stepper, steps, progress)
    progress("going back")
    items, same = _visits(
        stepper, np.random.default_rng(seed).integers(BACK + 1, steps, VISITS), digests
    )
    total = {
        "steps": steps,
        "kept_mb": grown_mb * KEPT_STEPS / (steps - WARM),
        "same": float(np.mean(same)),
        "slower": slower,
    }
    return {"items": items, "total": total}


def _stepped(stepper: Stepper, steps: int, progress: Progress) -> tuple[dict[int, bytes], float]:
    """Digests of every 50th step, and growth of memory, MB."""
    digests: dict[int, bytes] = {}
    stepper.step(WARM)
    gc.collect()
    before = resident_mb()
    while stepper.at < steps:
        step = stepper.step(EVERY).step
        assert step is not None
        digests[stepper.at] = _digest(step)
        if stepper.at % 1000 == 0:
            progress(f"{stepper.at} of {steps} steps")
    gc.collect()
    return digests, resident_mb() - before


def _visits(
    stepper: Stepper, places: NDArray[np.int64], digests: dict[int, bytes]
) -> tuple[dict[str, dict[str, float]], list[bool]]:
    """Times of going back, looking and branching from these steps; whether the following steps are equal."""
    back, look, branch, same = [], [], [], []
    for place in map(int, places):
        stepper.go(place)
        back.append(_ms(lambda: stepper.back(BACK)))
        near = -(-stepper.at // EVERY) * EVERY
        step = stepper.go(max(near, WARM + EVERY))
        same.append(step is not None and _digest(step) == digests[stepper.at])
        stepper.go(place)
        look.append(_ms(partial(stepper.at_step, place - BACK)))
        stepper.back(BACK)
        branch.append(_ms(lambda: stepper.branch().step(1)))
    return {"back": _times(back), "look": _times(look), "branch": _times(branch)}, same


def missed(figures: dict[str, Any]) -> list[str]:
    """The bars that figures miss, one sentence each."""
    back, kept = figures["items"]["back"]["most_ms"], figures["total"]["kept_mb"]
    found = [f"back({BACK}) took {back:.0f} ms, the bar is {BACK_MS:g}"] if back > BACK_MS else []
    if kept > KEPT_MB:
        found.append(f"{KEPT_STEPS} steps keep {kept:.0f} MB, the bar is {KEPT_MB:g}")
    if figures["total"]["same"] < 1.0:
        found.append("steps after going back differ from those before")
    return found


def _stepper(steps: int) -> Stepper:
    return Stepper(_agent(), ScriptedObservations(_own(seen) for seen in moving_ellipses(steps)))


def _agent() -> Any:
    return reasoning_agent(WatchSettings("scripted", tasks=("dock",)))


def _own(observation: Observation) -> Observation:
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


def _slower() -> float:
    """Short blocks with and without alternate, so that other load affects both."""
    agent, it = _agent(), _stepper((BLOCKS + 1) * BLOCK)
    frames: Iterator[Observation] = (_own(seen) for seen in moving_ellipses((BLOCKS + 1) * BLOCK))
    alone, stepped = [], []
    for _ in range(BLOCKS + 1):
        block = [next(frames) for _ in range(BLOCK)]
        begin = time.process_time()
        for seen in block:
            agent.reason(seen)
        middle = time.process_time()
        it.step(BLOCK)
        alone.append(middle - begin)
        stepped.append(time.process_time() - middle)
    making = _making()
    return float((np.percentile(stepped[1:], 25) - making) / np.percentile(alone[1:], 25))


def _making() -> float:
    """Processor time for generating a block of percepts, to be subtracted."""
    taken = []
    for _ in range(5):
        begin = time.process_time()
        for seen in moving_ellipses(BLOCK):
            _own(seen)
        taken.append(time.process_time() - begin)
    return float(np.percentile(taken, 25))


def whole(mind: Mind) -> Mind:
    """The same mind with its samples in canonical memory layout, which is no part of the beliefs."""
    kept = mind.recall(RELATIONS)
    return mind.remember(RELATIONS, replace(kept, history=replace(kept.history, start=0)))


def _digest(step: Step) -> bytes:
    return hashlib.sha256(
        dump_state((step.mind.objects, whole(step.mind).memory, step.events, step.alerts))
    ).digest()


def _ms(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return (time.process_time() - begin) * 1e3


def _times(taken: list[float]) -> dict[str, float]:
    return {"median_ms": float(np.median(taken)), "most_ms": max(taken)}
