"""Where observations come from: behaviours that look at frames, a recorded run, or a script."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from visup.agent import Frame, Observation
from visup.agent.cycle.agent import Agent
from visup.agent.storage.journal_reader import Recording


@dataclass(frozen=True, slots=True, eq=False)
class StepInput:
    """What the next step begins with.

    Attributes:
        seen: What was perceived.
        answers: What the operator said before it in a recorded run; None where nothing is recorded.
        frame: The frame, where there is one.
    """

    seen: Observation
    answers: Mapping[int, str] | None = None
    frame: Frame | None = None


@runtime_checkable
class ObservationSource(Protocol):
    """Gives one observation after the other; it cannot go back."""

    def next(self, agent: Agent) -> StepInput | None:
        """What comes next, for an agent that is after the latest step; None at the end."""
        ...


class LiveObservations:
    """The agent's behaviours look at frames."""

    def __init__(self, frames: Iterable[Frame]) -> None:
        self._frames = iter(frames)

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        frame = next(self._frames, None)
        return None if frame is None else StepInput(agent.perceive(frame), None, frame)


class RecordedObservations:
    """What a run perceived, and what its operator said, from its journal."""

    def __init__(self, recording: Recording) -> None:
        self._seen: Iterator[Observation] = recording.observations()
        self._answers = recording.answers()

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        seen = next(self._seen, None)
        return None if seen is None else StepInput(seen, self._answers.get(seen.frame_index, {}))


class ScriptedObservations:
    """Observations that are there already, such as scripted ones."""

    def __init__(self, seen: Iterable[Observation]) -> None:
        self._seen = iter(seen)

    def next(self, agent: Agent) -> StepInput | None:
        """See `ObservationSource`."""
        seen = next(self._seen, None)
        return None if seen is None else StepInput(seen)
