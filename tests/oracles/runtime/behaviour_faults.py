"""`visup eval faults`: behaviours that misbehave, in runs that must end, and in which all is told.

In each trial two objects close in on each other, told by scripted behaviours, one of which
misbehaves for a while. Looked at are, in every step:

- whether the run goes on to its end;
- whether the fault is told in the very step in which it took place (an alert is open, the report
  says so), and how much longer than its budget that step took;
- whether the agent's own reasoners get through it;
- whether all that the behaviour gives is unknown until it has run again;
- whether a word of the rule language is true or false while what it reads is unknown, or an alert
  is told to be over while that cannot be known. Every word is asked, both ways, by rules of its own.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np

from tests.oracles.runtime.fault_injection import ALLOWED_MB, DEADLY, FAULTS, FaultyBehaviour
from visup.agent import Contract, Depth, Health, HealthStatus, Hypothesis
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.records import FAULT_STATES, ReportState
from visup.agent.model.step import Step
from visup.evaluation.figures import Progress, silent
from visup.rules.formula.nodes import Rule
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.rules.predicates.inputs_missing import percepts_read
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES
from visup.rules.reasoners import default_reasoners
from visup.testing import LabelledFrame, Scripted, crossing

COUNT = 1000
FRAMES = 45
FPS = 10.0
BUDGET_S = 0.25
SLOW_MEMORY_S = 2.0
"""The budget where memory grows, seconds: some virtual machines take 10 ms for a megabyte that was not in use
before, which would be another fault."""
KINDS = ("region", "hypothesis", "depth", "health", "lamp")
PROBE = "probe_"
ARGUMENTS = {
    "relation": "converging",
    "kind": "region",
    "name": "disc",
    "zone": "bay",
    "allen": "before",
    "tpcc": "clf",
    "signal": "battery",
    "word": "auto",
}


@dataclass(slots=True)
class BehaviourFaultTrial:
    """One fault and what came of it.

    Attributes:
        number: Within the campaign.
        fault: A key of `FAULTS`.
        kind: What the behaviour gives.
        isolated: Whether it ran in a process of its own.
        at: Index of the frame of the fault.
        problems: What was not as it should be.
        over_ms: How much longer than the budget the step of the fault took.
        recovered: Whether the behaviour ran again in the end.
    """

    number: int
    fault: str
    kind: str
    isolated: bool
    at: int
    problems: list[str] = field(default_factory=list)
    over_ms: float = 0.0
    recovered: bool = False

    @property
    def budget_s(self) -> float:
        """What the behaviour may take, seconds."""
        return SLOW_MEMORY_S if self.fault == "memory growth" else BUDGET_S


def evaluate_faults(
    *,
    count: int = COUNT,
    seed: int = 0,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Inject faults, one a run.

    Args:
        count: How many; they go round the kinds of fault.
        seed: Of all that is drawn.
        progress: Shows what is being done.

    Returns:
        `items` by kind of fault and `total`, with the keys `trials`, `isolated`, `ended`,
        `told`, `unknown`, `thought`, `fine`, `back` (counts) and `over_ms` (the worst); `failures` lists
        what was not as it should be.
    """
    trials = []
    for number in range(count):
        trial = draw(number, seed)
        progress(f"{number + 1} of {count}, {trial.fault}")
        run(trial)
        trials.append(trial)
    names = [name for name in FAULTS if any(t.fault == name for t in trials)]
    return {
        "items": {name: _figures([t for t in trials if t.fault == name]) for name in names},
        "total": _figures(trials),
        "failures": [
            {"number": t.number, "fault": t.fault, "kind": t.kind, "problem": p}
            for t in trials
            for p in t.problems
        ],
    }


def draw(number: int, seed: int) -> BehaviourFaultTrial:
    """What is tried: kinds of fault go round, the rest is drawn."""
    rng = np.random.default_rng([seed, number])
    names = list(FAULTS)
    fault = names[number % len(names)]
    isolated = fault in DEADLY or bool(rng.random() < 0.4)
    return BehaviourFaultTrial(
        number, fault, str(rng.choice(KINDS)), isolated, int(rng.integers(2, 24))
    )


def run(trial: BehaviourFaultTrial) -> None:
    """Run one trial and note what came of it."""
    rng = np.random.default_rng([trial.number, trial.at])
    contract = Contract(
        "culprit",
        gives=(trial.kind,),
        cost_ms=trial.budget_s * 1000.0,
        isolate=trial.isolated,
        memory_mb=ALLOWED_MB,
    )
    lasts = int(rng.integers(1, 5))
    culprit = FaultyBehaviour(
        contract, _truth()[trial.kind], trial.fault, trial.at, lasts, 1.5 * trial.budget_s
    )
    others = [_honest(kind) for kind in KINDS if kind != trial.kind]
    rules = default_reasoners(rules=(*shipped_rules(), *probes()))
    agent = Agent(
        [*others, culprit],
        Reasoners(rules.update, rules.cogitate),
        limits=Limits(budgets=bool(rng.random() < 0.5), hang_s=trial.budget_s),
    )
    try:
        _watch(trial, agent)
    except BaseException as fault:
        if isinstance(fault, KeyboardInterrupt):
            raise
        trial.problems.append(f"ended: {type(fault).__name__}: {fault}")
    finally:
        agent.close()


def _watch(trial: BehaviourFaultTrial, agent: Agent) -> None:
    for shot in _shots():
        begin = time.perf_counter()
        step = agent.step(shot.frame)
        if shot.frame.index == trial.at:
            trial.over_ms = (time.perf_counter() - begin - trial.budget_s) * 1000.0
            if not _told(step):
                trial.problems.append("told: nothing was told in the step of the fault")
        _judge(trial, step)
        if trial.isolated and agent.limits.budgets and _report(step).state is ReportState.LATE:
            time.sleep(1.0 / FPS)  # frames come in real time then, in which a process starts
    trial.recovered = _report(step).state is ReportState.RAN


def _judge(trial: BehaviourFaultTrial, step: Step) -> None:
    """Look for what is taken for known in one step although it is unknown."""
    broken = _report(step).state in FAULT_STATES
    if broken and (trial.kind not in step.mind.unknown or step.observation.observed(trial.kind)):
        trial.problems.append(f"unknown: '{trial.kind}' counts as observed")
    if broken and not _told(step):
        trial.problems.append("told: no alert is open while it is broken")
    unknown = step.mind.unknown
    for alert in step.mind.alerts:
        if alert.kind == "reasoning_failed":
            trial.problems.append(f"thought: {alert.cause} {' '.join(alert.evidence)}")
            return  # no rule was read in this step
        word = alert.kind.removeprefix(PROBE).rpartition("_")[0]
        fresh = alert.updated == step.time
        if alert.kind.startswith(PROBE) and fresh and unknown & percepts_read(word):
            trial.problems.append(f"fine: {alert.kind} holds while {sorted(unknown)} is unknown")
    for alert in step.alerts:
        if alert.closed is not None and unknown.intersection(alert.needs):
            trial.problems.append(f"fine: alert '{alert.kind}' closed while {sorted(unknown)}")


def _told(step: Step) -> bool:
    open_now = any(a.kind == "behaviour_failed" and a.key == "culprit" for a in step.mind.alerts)
    return open_now and _report(step).state in FAULT_STATES


def _report(step: Step) -> Any:
    return next(r for r in step.reports if r.behaviour == "culprit")


@cache
def probes() -> tuple[Rule, ...]:
    """Two rules for each word: one is true when the word is, the other when its negation is."""
    lines = []
    for name, word in PREDICATES.items():
        lines += _pair(name, word.argument_kinds, "{call}", "not {call}")
    for name, quantity in QUANTITIES.items():
        one = "1" if quantity.plain else f"1 {quantity.unit}"
        lines += _pair(name, quantity.argument_kinds, f"{{call}} >= {one}", f"{{call}} < {one}")
    return parse_rules("\n".join(lines))


def _pair(name: str, takes: Sequence[str], yes: str, no: str) -> list[str]:
    variables = ("a", "b", "c")[: sum(t == "object" for t in takes)]
    free = iter(variables)
    words = [next(free) if t == "object" else ARGUMENTS[t] for t in takes]
    call = f"{name}({', '.join(words)})"
    return [
        f"rule {PROBE}{name}_{tag}({', '.join(variables)}): info\n"
        f"    when {form.format(call=call)}\n"
        f'    say "{name}."\n'
        for tag, form in (("yes", yes), ("no", no))
    ]


@cache
def _shots() -> list[LabelledFrame]:
    return crossing(FRAMES, fps=FPS)


@cache
def _truth() -> Mapping[str, Mapping[int, Sequence[Any]]]:
    """Kind -> frame index -> values."""
    shots = {s.frame.index: s.regions for s in _shots()}
    return {
        "region": shots,
        "hypothesis": {
            i: [Hypothesis(r.id, "disc", 0, 0.9, 0.0, 1.0) for r in regions]
            for i, regions in shots.items()
        },
        "depth": {
            i: [Depth(r.id, "disc", 10.0, 0.5) for r in regions] for i, regions in shots.items()
        },
        "health": {i: [Health(HealthStatus.OK)] for i in shots},
        "lamp": {i: [float(i)] for i in shots},
    }


def _honest(kind: str) -> Scripted:
    truth = _truth()[kind]
    return Scripted(f"true_{kind}", (kind,), lambda frame: list(truth[frame.index]))


def _figures(trials: Sequence[BehaviourFaultTrial]) -> dict[str, Any]:
    wrong = Counter(what for t in trials for what in {p.partition(":")[0] for p in t.problems})
    return {
        "trials": len(trials),
        "isolated": sum(t.isolated for t in trials),
        "ended": len(trials) - wrong["ended"],
        "told": len(trials) - wrong["told"],
        "unknown": len(trials) - wrong["unknown"],
        "thought": len(trials) - wrong["thought"],
        "fine": wrong["fine"],
        "back": sum(t.recovered for t in trials),
        "over_ms": max((t.over_ms for t in trials), default=0.0),
    }
