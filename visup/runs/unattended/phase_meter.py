"""Time spent in each phase of a step, for the metrics of a service."""

from __future__ import annotations

import time
from collections.abc import Callable

from visup.agent import Frame
from visup.agent.contract.phases import Phase
from visup.agent.cycle.agent import Agent
from visup.agent.model.step import Step

OBSERVE = "observe"
"""After the phases of the cycle: the journal, sinks and other observers."""


class PhaseMeter:
    """Executes and measures the steps of an agent.

    Args:
        clock: Seconds of a monotonic clock.

    Attributes:
        ms: Total time of each phase, milliseconds.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self.ms: dict[str, float] = {phase.value: 0.0 for phase in Phase} | {OBSERVE: 0.0}
        self._clock = clock
        self._since = 0.0

    def step(self, agent: Agent, frame: Frame) -> Step:
        """As `Agent.step`, measured."""
        self._since = self._clock()
        observation = agent.perceive(frame)
        self._over(Phase.PERCEIVE)
        for phase, outcome in agent.phases(observation):
            self._over(phase)
            last_outcome = outcome
        step = agent.act(observation, last_outcome)
        self._over(Phase.ACT)
        for observer in agent.observers:
            observer(step, frame)
        self._over(OBSERVE)
        return step

    def _over(self, phase: str) -> None:
        now = self._clock()
        self.ms[str(phase)] += 1000.0 * (now - self._since)
        self._since = now
