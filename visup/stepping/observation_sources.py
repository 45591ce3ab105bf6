"""Sources of observations: behaviours on frames, a recorded run, or a script."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from visup.agent import Frame, Observation
from visup.agent.cycle.agent import Agent
from visup.agent.storage.journal_reader import Recording


@dataclass(frozen=True, slots=True, eq=False)
class StepInput:
    """The input of the next step.

    Attributes:
        observation: The observation.
        answers: The operator's answers before it in a recorded run; None if not recorded.
        frame: The frame, or None.
    """

    observation: Observation
    answers: Mapping[int, str] | None = None
    frame: Frame | None = None


@runtime_checkable
class ObservationSource(Protocol):
    """Provides observations one by one; it cannot go back."""

    def next(self, agent: Agent) -> StepInput | None:
        """The next input, for an agent after the latest step; None at the end."""
        ...


class LiveObservations:
    """Observations of the agent's behaviours on frames."""

    def __init__(self, frames: Iterable[Frame]) -> None:
        self._frames = iter(frames)

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        frame = next(self._frames, None)
        return None if frame is None else StepInput(agent.perceive(frame), None, frame)


class RecordedObservations:
    """Observations and answers from the journal of a run."""

    def __init__(self, recording: Recording) -> None:
        self._observations: Iterator[Observation] = recording.observations()
        self._answers = recording.answers()

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        observation = next(self._observations, None)
        return (
            None
            if observation is None
            else StepInput(observation, self._answers.get(observation.frame_index, {}))
        )


class ScriptedObservations:
    """Given observations, such as scripted ones."""

    def __init__(self, observations: Iterable[Observation]) -> None:
        self._observations = iter(observations)

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        observation = next(self._observations, None)
        return None if observation is None else StepInput(observation)
