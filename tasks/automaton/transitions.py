"""Transition probabilities between hidden states over a time step, computed on demand.

A hidden state is a node of the automaton with the phase of each active step (`HiddenState`). A transition is
a combination of phase changes, followed by at most one transition of the automaton.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

from visup.tasks.automaton.automaton import END, NEW, Automaton, Transition
from visup.tasks.automaton.stage_hmm import WAITING, PhaseKind, StageHmm
from visup.tasks.automaton.states import TaskStep

MAX_SPANS = 64  # cached time steps
SPAN_DIGITS = 4  # time steps are rounded to a tenth of a millisecond


class HiddenState(NamedTuple):
    """A hidden state: a node, and the phase of each of its steps."""

    node: int
    phases: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class HiddenTransition:
    """A transition between hidden states.

    Attributes:
        to: The target.
        chance: Its probability.
        left: The steps that it completes.
    """

    to: HiddenState
    chance: float
    left: tuple[TaskStep, ...] = ()


Required = tuple[tuple[tuple[str, tuple[str, ...]], PhaseKind], ...]
"""The expected observations in a state: each action with its actors, and its phase kind."""


class HiddenTransitions:
    """Transitions between the hidden states of a task.

    Args:
        automaton: The states of its course.
        hmm: The probabilities.
    """

    def __init__(self, automaton: Automaton, hmm: StageHmm) -> None:
        self.automaton = automaton
        self.hmm = hmm
        self._passages: dict[float, dict[HiddenState, tuple[HiddenTransition, ...]]] = {}
        self._asked: dict[HiddenState, Required] = {}

    def begin(self) -> Iterator[tuple[HiddenState, float]]:
        """Initial states with their probabilities."""
        for node, share in self.automaton.start:
            yield HiddenState(node, (WAITING,) * len(self.automaton.steps(node))), share

    def after(self, dt: float) -> dict[HiddenState, tuple[HiddenTransition, ...]]:
        """The cached transitions for a time step; `transitions` adds to them."""
        span = round(dt, SPAN_DIGITS)
        if span not in self._passages:
            if len(self._passages) >= MAX_SPANS:
                self._passages.clear()
            self._passages[span] = {}
        return self._passages[span]

    def transitions(self, state: HiddenState, dt: float) -> tuple[HiddenTransition, ...]:
        """All transitions from a state in `dt` seconds; their probabilities sum to 1."""
        known = self.after(dt)
        if state not in known:
            known[state] = _merged(self._passed(state, round(dt, SPAN_DIGITS)))
        return known[state]

    def required(self, state: HiddenState) -> Required:
        """The expected observations in a state; an action required by several steps is listed once."""
        if state not in self._asked:
            found: dict[tuple[str, tuple[str, ...]], PhaseKind] = {}
            for step, phase in zip(self.automaton.steps(state.node), state.phases, strict=True):
                kind, key = self.hmm.kind(step, phase), (step.action, step.actors)
                found[key] = min(kind, found.get(key, kind), key=CLEAREST.index)
            told = tuple((k, kind) for k, kind in found.items() if kind is not PhaseKind.WAITING)
            self._asked[state] = told
        return self._asked[state]

    def _passed(self, state: HiddenState, dt: float) -> Iterator[HiddenTransition]:
        steps = self.automaton.steps(state.node)
        changes = [
            tuple(self.hmm.changes(s, p, dt)) for s, p in zip(steps, state.phases, strict=True)
        ]
        for changed in product(*changes):
            phases = tuple(phase for phase, _ in changed)
            chance = math.prod(p for _, p in changed)
            yield from self._moved_on(HiddenState(state.node, phases), chance, dt)

    def _moved_on(self, state: HiddenState, chance: float, dt: float) -> Iterator[HiddenTransition]:
        """A state after its phase changes, and the transitions from it."""
        node, phases = state
        transitions = self.automaton.transitions(node)
        rates = [self.rate(node, phases, w) for w in transitions]
        total = sum(rates)
        gone = -math.expm1(-total * dt)
        yield HiddenTransition(state, chance * (1.0 - gone))
        if gone > 0.0:
            steps = self.automaton.steps(node)
            for transition, rate in zip(transitions, rates, strict=True):
                if rate > 0.0:
                    left = tuple(steps[i] for i in transition.left)
                    yield HiddenTransition(
                        _target(transition, phases), chance * gone * rate / total, left
                    )

    def rate(self, node: int, phases: tuple[int, ...], transition: Transition) -> float:
        """Rate of a transition: that of the slowest step that it completes."""
        steps = self.automaton.steps(node)
        return transition.share * min(
            self.hmm.leaving(steps[i], phases[i]) for i in transition.left
        )


# Of several steps that require the same action, the phase that comes first here is expected.
CLEAREST = (PhaseKind.GOING, PhaseKind.FAILING, PhaseKind.LOST, PhaseKind.WAITING)


def _target(transition: Transition, phases: tuple[int, ...]) -> HiddenState:
    if transition.target == END:
        return HiddenState(END, ())
    return HiddenState(
        transition.target, tuple(WAITING if c == NEW else phases[c] for c in transition.carried)
    )


def _merged(passages: Iterator[HiddenTransition]) -> tuple[HiddenTransition, ...]:
    found: dict[tuple[HiddenState, tuple[TaskStep, ...]], float] = {}
    for transition in passages:
        if transition.chance > 0.0:
            key = (transition.to, transition.left)
            found[key] = found.get(key, 0.0) + transition.chance
    return tuple(HiddenTransition(to, chance, left) for (to, left), chance in found.items())
