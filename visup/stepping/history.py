"""Access to all past steps at low cost: stored observations, occasional minds, and recomputation.

Reasoning is deterministic, so a step can be recomputed from the nearest stored mind before it. The spacing of
stored minds is a trade-off between the cost of going back (at most `SPACING` steps) and memory (one mind in
`SPACING`): consecutive minds share little data, because measured numbers differ. The latest steps are cached.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from visup.agent import Alert, Event, Observation, Outcome
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.cycle.agent import Agent
from visup.agent.model.step import Step
from visup.stepping.observation_log import ObservationLog

SPACING = 12
LATEST = 100


@dataclass(slots=True)
class StepHistory:
    """The steps of one timeline, and the current position.

    Attributes:
        agent: The agent, in its state after step `at`.
        observations: The observations, shared between a branch and its parent.
        at: The position: number of steps before it.
        begin: Number of steps before this timeline began: 0 except for branches.
        answers: Step number -> the operator's answers before the next step.
        spacing: Steps between stored minds.
        latest: Number of cached steps.
        made: Total number of steps made, including those before the beginning.
    """

    agent: Agent
    observations: ObservationLog = field(default_factory=ObservationLog)
    at: int = 0
    begin: int = field(init=False)
    made: int = field(init=False)
    answers: dict[int, Mapping[int, str]] = field(default_factory=dict)
    spacing: int = SPACING
    latest: int = LATEST
    _minds: dict[int, AgentSnapshot] = field(default_factory=dict, init=False)
    _cached: OrderedDict[int, tuple[Step, AgentSnapshot]] = field(
        default_factory=OrderedDict, init=False
    )
    _reported: list[tuple[tuple[Event, ...], tuple[Alert, ...]]] = field(
        default_factory=list, init=False
    )

    def __post_init__(self) -> None:
        self.begin = self.made = self.at
        self._minds[self.at] = self.agent.snapshot()

    def branch(self, agent: Agent) -> StepHistory:
        """The history of a branch that starts here: another agent with the same observations and answers.

        Args:
            agent: The agent in its state here.
        """
        answers = {n: names for n, names in self.answers.items() if n >= self.at}
        return StepHistory(agent, self.observations, self.at, answers, self.spacing, self.latest)

    @property
    def present(self) -> AgentSnapshot:
        """The present state of the agent."""
        return self.agent.snapshot()

    def phases(self, observation: Observation) -> Iterator[tuple[Phase, Outcome]]:
        """The reasoning of the next step, phase by phase, up to the input of `conclude`."""
        self._note_answers()
        return self.agent.phases(observation, self.answers.get(self.at, {}))

    def conclude(self, observation: Observation, outcome: Outcome) -> Step:
        """The last phase of the next step."""
        step = self.agent.act(observation, outcome)
        self.at += 1
        state = self.agent.snapshot()
        if self.at > self.made:
            self.made = self.at
            self._reported.append((step.events, step.alerts))
            if (self.at - self.begin) % self.spacing == 0:
                self._minds[self.at] = state
        self._cached[self.at] = step, state
        if len(self._cached) > self.latest:
            self._cached.popitem(last=False)
        return step

    def forward(self) -> Step:
        """Make the next step on the stored observations."""
        observation = self.observations.observation(self.at)
        *_, (_, outcome) = self.phases(observation)
        return self.conclude(observation, outcome)

    def go(self, number: int) -> Step | None:
        """Move to the position after step `number`, which must have been made.

        Returns:
            That step; None at the beginning of the timeline.
        """
        self._note_answers()
        step = None
        nearest = max(n for n in (*self._minds, *self._cached) if n <= number)
        if not nearest < self.at < number:
            step = self._restore_nearest(nearest)
        while self.at < number:
            step = self.forward()
        return step

    def step(self, number: int) -> Step | None:
        """Step `number`, without moving there; None at the beginning of the timeline."""
        with self.position_kept():
            return self.go(number)

    def snapshot(self, number: int) -> AgentSnapshot:
        """The state of the agent after step `number`."""
        with self.position_kept():
            self.go(number)
            return self.present

    @contextmanager
    def position_kept(self) -> Iterator[None]:
        """A context that restores the position afterwards."""
        at, state = self.at, self.present
        try:
            yield
        finally:
            self.at = at
            self.agent.restore(state)

    def jump(self, number: int, state: AgentSnapshot) -> None:
        """Move to the position after step `number`, given the agent's state there."""
        self._note_answers()
        self.at = number
        self.agent.restore(state)

    def events(self, first: int = 1, last: int | None = None) -> Iterator[tuple[int, Event]]:
        """All events from step `first` to `last`, each with the number of its step."""
        end = self.made if last is None else min(last, self.made)
        for number in range(max(first, self.begin + 1), end + 1):
            for event in self._reported[number - self.begin - 1][0]:
                yield number, event

    def _note_answers(self) -> None:
        """Store the operator's answers since the latest step, before the agent's state changes."""
        if self.at == self.made and (answers := self.present.answers):
            self.answers[self.at] = {**self.answers.get(self.at, {}), **answers}

    def _restore_nearest(self, number: int) -> Step | None:
        """Move to a cached step or stored mind."""
        step, state = self._cached.get(number) or (None, self._minds[number])
        self.at = number
        self.agent.restore(state)
        if number == self.begin:
            return None
        if step is not None:
            self._cached.move_to_end(number)
            return step
        events, alerts = self._reported[number - self.begin - 1]
        observation, mind = self.observations.observation(number - 1), state.mind
        return Step(
            mind.frame_index, mind.time, observation, mind, events, alerts, state.directives
        )
