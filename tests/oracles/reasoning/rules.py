"""`visup eval rules`: the operators over time against an oracle and against rtamt; what rules cost."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isclose
from random import Random
from statistics import median
from typing import Any, Literal

import numpy as np

from tests.oracles import dense_formulas, rule_oracle, rule_peer
from tests.oracles import rule_formulas as drawn_formulas
from tests.oracles.dense_oracle import CELL_MS, DenseOracle
from tests.oracles.early_verdicts import both_told
from tests.oracles.reasoning.rule_scenes import FPS, minds, twenty_rules
from visup.agent import Mind, Observation
from visup.evaluation.figures import Progress, silent
from visup.rules.dense_time import Ends, judge_recording
from visup.rules.dense_time.compiler import horizon
from visup.rules.formula.nodes import Formula, Rule
from visup.rules.formula.units import ticks
from visup.rules.language.parser import parse_formula, shipped_rules
from visup.rules.monitoring.monitor import Monitor
from visup.rules.predicates.vocabulary import signals
from visup.rules.safety.reasoner import SAFETY, RuleReasoner

SIGNALS: tuple[str, ...] = drawn_formulas.SIGNALS
STEP_MS: int = drawn_formulas.STEP_MS

WINDOWS = (30, 300, 3000)
"""Lengths of windows whose cost is compared, samples."""
TIMED = ("x() >= 0.5 for {w} ms", "x() >= 0.5 within {w} ms")
"""Timed against rtamt too; its `since` takes the square of the window, and seconds for each sample."""
TIMED_ALONE = ("x() >= 0.1 since[{w} ms] y() >= 0.9",)
ROUNDS = 5
"""How often each time is taken; the best part of the best counts, whatever else the machine does."""
SNAPSHOTS = 10_000
PEER_SHARE = 10
"""One formula is compared with rtamt for so many that are compared with the oracle."""


def evaluate_rules(
    *, formulas: int = 10_000, seed: int = 0, progress: Progress = silent
) -> dict[str, Any]:
    """Compare and time the rule language.

    Args:
        formulas: How many random formulas are compared with the oracle.
        seed: Of all that is drawn.
        progress: Shows what is being done.

    Returns:
        Items `oracle`, `early`, `dense time`, `rtamt` (left out when it is not installed), `window N`,
        `N objects` and `snapshots`; the total holds `slower`, what a window of 3000 costs over one of 30, and
        whether rtamt was there.
    """
    items: dict[str, dict[str, Any]] = {}
    progress("formulas against the oracle")
    items["oracle"] = _against_oracle(formulas, seed)
    progress("what is foreseen against what is told")
    items["early"] = _foreseen(formulas, seed)
    progress("dense time against its oracle")
    items["dense time"] = _against_dense_oracle(formulas // 5, seed)
    peer = rule_peer.available()
    if peer:
        progress("formulas against rtamt")
        items["rtamt"] = _against_peer(formulas // PEER_SHARE, seed)
    progress("windows")
    items |= _throughput(seed, peer)
    for objects in (3, 10):
        progress(f"twenty rules, {objects} objects")
        items[f"{objects} objects"] = _rule_cost(objects)
    progress("snapshots")
    items["snapshots"] = _snapshots()
    slower = items[f"window {WINDOWS[-1]}"]["slower"]
    return {"items": items, "total": {"slower": slower, "rtamt": peer}}


def alike(one: Sequence[float], other: Sequence[float]) -> bool:
    """Whether two intervals are equal but for the last digits of a division."""
    return all(
        p == q or isclose(p, q, rel_tol=1e-9, abs_tol=1e-9) for p, q in zip(one, other, strict=True)
    )


def _against_oracle(count: int, seed: int) -> dict[str, Any]:
    samples = different = 0
    for number in range(count):
        rng = Random(f"{seed} {number}")
        formula = drawn_formulas.random_formula(rng, rng.randint(1, 3))
        times = drawn_formulas.random_times(rng, rng.randint(5, 25))
        values = [{name: drawn_formulas.random_value(rng) for name in SIGNALS} for _ in times]
        monitor = Monitor(formula)
        given = [{n: drawn_formulas.as_given(rng, v) for n, v in row.items()} for row in values]
        told = [monitor.step(t, v) for t, v in zip(times, given, strict=True)]
        truth = rule_oracle.robustness(
            formula, [(ticks(t), v) for t, v in zip(times, values, strict=True)]
        )
        samples += len(times)
        different += not all(map(alike, told, truth))
    return {"formulas": count, "samples": samples, "different": different}


def _foreseen(count: int, seed: int) -> dict[str, Any]:
    """Of formulas about the future: moments decided early, and those of which the end says otherwise."""
    late = samples = different = 0
    for number in range(count):
        rng = Random(f"{seed} early {number}")
        formula = drawn_formulas.random_formula(rng, rng.randint(1, 4))
        if not horizon(formula):
            continue
        late += 1
        pairs = both_told(formula, rng, 450_000)
        samples += sum(low > 0 or high < 0 for (low, high), _ in pairs)
        different += any(e[0] > told[0] or e[1] < told[1] for e, told in pairs)
    return {"formulas": late, "samples": samples, "different": different}


def _against_dense_oracle(count: int, seed: int) -> dict[str, Any]:
    """Irregular samples, with values of NumPy, judged in all cells of time."""
    samples = different = 0
    for number in range(count):
        rng = Random(f"{seed} dense {number}")
        formula = dense_formulas.dense_formula(rng, rng.randint(1, 3))
        drawn, cut = dense_formulas.random_recording(rng, rng.randint(2, 14)), rng.random() < 0.5
        truth = DenseOracle(dense_formulas.held(drawn), cut).cells(formula)
        ends: Literal["cut", "unknown"] = "cut" if cut else "unknown"
        told = judge_recording(
            formula,
            [(k * CELL_MS / 1000, _numpy(v)) for k, v in drawn],
            ends=Ends(ends, ends),
            end_s=len(truth) * CELL_MS / 1000,
        )
        moments = (k * CELL_MS / 1000 for k in range(len(truth)))
        mine = [next(v.robustness for v in told if v.begin_s <= t < v.end_s) for t in moments]
        samples += len(drawn)
        different += not all(map(alike, mine, truth))
    return {"formulas": count, "samples": samples, "different": different}


def _numpy(values: Mapping[str, tuple[float, float]]) -> dict[str, Any]:
    """The same values as NumPy gives them; what is not known is NaN."""
    return {
        n: np.float64("nan") if v == (-inf, inf) else (np.float64(v[0]), np.float64(v[1]))
        for n, v in values.items()
    }


def _against_peer(count: int, seed: int) -> dict[str, Any]:
    samples = different = online = 0
    for number in range(count):
        rng = Random(f"{seed} peer {number}")
        formula = rule_peer.shared_formula(rng, rng.randint(1, 3))
        monitor = Monitor(formula)
        late = round(monitor.delay * 1000 / STEP_MS)
        begin = late + rule_peer.horizon(formula)
        drawn = {name: [rng.randint(-10, 10) / 2 for _ in range(begin + 20)] for name in SIGNALS}
        rows = [dict(zip(drawn, row, strict=True)) for row in zip(*drawn.values(), strict=True)]
        told = [monitor.step(k * STEP_MS / 1000, row) for k, row in enumerate(rows)]
        theirs = rule_peer.offline(formula, drawn)
        same = all(alike(told[k], (theirs[k - late],) * 2) for k in range(begin, len(rows)))
        if late == 0:
            update = rule_peer.online(formula, SIGNALS)
            live = [update(k, list(row.items())) for k, row in enumerate(rows)]
            same = same and all(alike(told[k], (live[k],) * 2) for k in range(begin, len(rows)))
            online += 1
        samples += len(rows) - begin
        different += not same
    return {"formulas": count, "samples": samples, "online": online, "different": different}


def _throughput(seed: int, peer: bool) -> dict[str, dict[str, Any]]:
    """Microseconds of the processor per sample; the least favourable of the operators counts.

    Windows take turns, so that what else the machine does falls on all of them alike.
    """
    rng = Random(seed)
    drawn = [(rng.random(), rng.random()) for _ in range(6 * max(WINDOWS))]
    texts = (*TIMED, *TIMED_ALONE)
    best = {(w, t): float("inf") for t in texts for w in WINDOWS}
    for _ in range(ROUNDS):
        for window, text in best:
            formula = _windowed(text, window)
            best[window, text] = min(best[window, text], _ours(formula, drawn, window))
    found: dict[str, dict[str, Any]] = {}
    for window in WINDOWS:
        slowest = max(best[window, t] for t in texts)
        figures = {"us": slowest, "samples_per_s": 1e6 / slowest}
        figures["slower"] = max(best[window, t] / best[WINDOWS[0], t] for t in texts)
        if peer:
            ratios = (_theirs(_windowed(t, window), drawn, window) / best[window, t] for t in TIMED)
            figures["times_rtamt"] = min(ratios)
        found[f"window {window}"] = figures
    return found


def _windowed(text: str, window: int) -> Formula:
    return parse_formula(text.format(w=window * STEP_MS), signals(*SIGNALS))


def _ours(formula: Formula, drawn: list[tuple[float, float]], window: int) -> float:
    monitor = Monitor(formula)
    for k in range(max(WINDOWS)):
        x, y = drawn[k]
        monitor.step(k * STEP_MS / 1000, {"x": x, "y": y})
    best = inf
    # As long as the longest window, so that each part holds all that a window costs now and then.
    for start in range(max(WINDOWS), len(drawn), max(WINDOWS)):
        begin = time.process_time()
        for k in range(start, start + max(WINDOWS)):
            x, y = drawn[k]
            monitor.step(k * STEP_MS / 1000, {"x": x, "y": y})
        best = min(best, time.process_time() - begin)
    return best / max(WINDOWS) * 1e6


def _theirs(formula: Formula, drawn: list[tuple[float, float]], window: int) -> float:
    update = rule_peer.online(formula, SIGNALS)
    for k in range(window):
        x, y = drawn[k]
        update(k, [("x", x), ("y", y)])
    best = float("inf")
    each = max(50, 3000 // window)
    for part in range(3):
        begin = time.process_time()
        for k in range(window + part * each, window + (part + 1) * each):
            x, y = drawn[k]
            update(k, [("x", x), ("y", y)])
        best = min(best, (time.process_time() - begin) / each * 1e6)
    return best


def _rule_cost(objects: int, frames: int = 250) -> dict[str, Any]:
    """Milliseconds of one step of twenty rules, the first 50 steps left out."""
    rules = twenty_rules()
    taken, concerns = _timed(rules, list(minds(objects, frames)))
    return {"rules": len(rules), "ms": median(taken[50:]) * 1e3, "concerns": median(concerns[50:])}


def _timed(rules: tuple[Rule, ...], seen: list[Mind]) -> tuple[list[float], list[int]]:
    reasoner, memory = RuleReasoner(rules), None
    nothing = Observation(0, 0.0, (0, 0))
    taken, concerns = [], []
    for mind in seen:
        if memory is not None:
            mind = mind.remember(SAFETY, memory)
        begin = time.perf_counter()
        outcome = reasoner(mind, nothing)
        taken.append(time.perf_counter() - begin)
        concerns.append(len(outcome.conditions))
        memory = outcome.mind.recall(SAFETY)
    return taken, concerns


def _snapshots(count: int = SNAPSHOTS) -> dict[str, Any]:
    """Memory of what rules remember in as many minds, all kept; three objects, the shipped rules."""
    reasoner, mind = RuleReasoner(shipped_rules()), list(minds(3, 50))[-1]
    nothing = Observation(0, 0.0, (0, 0))
    kept = []
    tracemalloc.start()
    for k in range(count):
        mind = reasoner(replace(mind, time=2.0 + k / FPS), nothing).mind
        kept.append(mind.recall(SAFETY))
    held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return {"kept": len(kept), "kb_each": held / count / 1024}
