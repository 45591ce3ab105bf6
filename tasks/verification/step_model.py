"""Observation model of one step: its phase, and the likelihood of observations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from visup.agent import Relation, Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.automaton.stage_hmm import WAITING, ActionStatus, StageHmm
from visup.tasks.automaton.states import Leaf, State, TaskStep, leaves
from visup.tasks.verification.concurrent_actions import reset_lapsed_actions
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.settings import TaskSettings
from visup.tasks.verification.step_monitor import BAD, Moment, StepMonitor, over, update_monitor

Observe = Callable[[TaskStep], ActionObservation]
"""The present observation of a step."""


@dataclass(frozen=True)
class StepModel:
    """The observation model of the steps of a task.

    Attributes:
        actions: Action definitions by name.
        settings: Time constants.
        hmm: The probabilities of the model.
    """

    actions: Mapping[str, ActionDefinition]
    settings: TaskSettings
    hmm: StageHmm

    def observed(
        self, leaf: Leaf[StepMonitor], seen: ActionObservation, moment: Moment, done: bool
    ) -> Leaf[StepMonitor]:
        """A step with its monitor updated by an observation, unless work is paused.

        Args:
            leaf: An active step.
            seen: Its observation.
            moment: Time of the observation.
            done: Whether the task is completed.
        """
        if seen.paused:
            return leaf
        # A `within` no longer matters once the task is done.
        step = replace(leaf.step, deadlines=()) if done else leaf.step
        meaning = self.actions[step.action]
        monitor = update_monitor(leaf.payload, step, meaning, seen, moment, self.settings)
        return leaf if monitor is leaf.payload else Leaf(leaf.step, monitor)

    def held_before(
        self, leaf: Leaf[StepMonitor], seen: ActionObservation, held_by: Relation, now: float
    ) -> Leaf[StepMonitor]:
        """A step that begins now, updated as if a relation still held that has just become uncertain."""
        then = replace(seen, observed=True, holds=Truth.TRUE, held_by=held_by, helps=held_by)
        return self.observed(leaf, then, Moment(now, 0.0), False)

    def together(self, state: State[StepMonitor], observe: Observe) -> State[StepMonitor]:
        """The state with monitors corrected so that actions joined by `&` must have held at the same time."""

        def gap(step: TaskStep, since: float, until: float) -> float:
            return observe(step).elapsed(step, since, until) if until > since else 0.0

        return reset_lapsed_actions(state, self._judged, gap, self.settings.contact_s)

    def _judged(self, step: TaskStep) -> bool:
        return not self.actions[step.action].lasts and not step.has_stage_conditions

    def joint_fit(
        self, state: State[StepMonitor], observe: Observe, done: bool, dt: float
    ) -> float:
        """Likelihood of `dt` seconds of the observations of all active steps; see `fit`.

        An event that contradicts several actions of one stage counts once: a tug that leaves without its cart
        neither moves together with it nor moves it.
        """
        active = leaves(state)
        failing = {x.step.stage for x in active if x.payload.status in BAD}
        whole, worst = 1.0, dict[str, float]()
        for leaf in active:
            seen, stage = observe(leaf.step), leaf.step.stage
            fit = self.fit(leaf, seen, done, dt, failing=stage in failing)
            if seen.contrary is None:
                whole *= fit
            else:
                worst[stage] = min(fit, worst.get(stage, 1.0))
        return whole * math.prod(worst.values())

    def fit(
        self,
        leaf: Leaf[StepMonitor],
        seen: ActionObservation,
        done: bool,
        dt: float,
        *,
        failing: bool,
    ) -> float:
        """Likelihood of `dt` seconds of an observation, relative to the best: at most 1, and 1 in a pause.

        Args:
            leaf: An active step.
            seen: Its observation.
            done: Whether the task is completed.
            dt: Duration of the observation, seconds.
            failing: Whether its stage fails, by this step or by another one that it requires as well.
        """
        if seen.paused:
            return 1.0
        if not seen.observed:
            return self.hmm.fit(ActionStatus.UNKNOWN, 1.0, dt)
        bad = leaf.payload.status in BAD or seen.contrary is not None
        if failing and bad and not done:
            # The onset of failure was penalised already; from then on its contrary is expected.
            return math.exp(-self.hmm.recover * dt)
        if seen.contrary is not None and _counts(seen):
            return self.hmm.fit(ActionStatus.CONTRARY, seen.contrary.confidence, dt)
        if done or self.over(leaf) or (seen.helps is not None and leaf.payload.held):
            return 1.0
        if seen.helps is not None or leaf.payload.begun is None:
            return math.exp(-self.hmm.begin * dt)  # it has not begun to hold in all that time
        return self.hmm.fit(ActionStatus.NEITHER, 1.0, dt)

    def over(self, leaf: Leaf[StepMonitor]) -> bool:
        """Whether a step is over by itself, without the next one having begun."""
        return over(leaf.payload, leaf.step, self.actions[leaf.step.action])

    def phase(self, leaf: Leaf[StepMonitor]) -> int:
        """The phase of a step in `StageHmm`."""
        monitor, whole = leaf.payload, self.hmm.count(leaf.step)
        if monitor.status in BAD:
            return whole + (1 if monitor.status is Status.FAILING else 2)
        if monitor.fulfilled:
            return whole
        return WAITING if monitor.begun is None else 1

    def gain(self, leaf: Leaf[StepMonitor], seen: ActionObservation) -> float:
        """Evidence per second that a step is in progress; see `MonitoredPhases.gain`."""
        fit = self.hmm.fit
        if not seen.observed or self.over(leaf):
            return 0.0
        if seen.contrary is not None and _counts(seen):
            return math.log(fit(ActionStatus.CONTRARY, seen.contrary.confidence, 1.0))
        if seen.helps is not None:
            return -math.log(fit(ActionStatus.CONTRARY, seen.helps.confidence, 1.0))
        return 0.0 if leaf.payload.begun is None else math.log(fit(ActionStatus.NEITHER, 1.0, 1.0))


def _counts(seen: ActionObservation) -> bool:
    """Whether a contrary counts: not while the action holds, unless the course itself states the contrary."""
    return seen.decisive or seen.holds is not Truth.TRUE
