"""One timeline of an agent with forward, backward and partial steps."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

from visup.agent import Event, Frame, Mind, Observation, Outcome
from visup.agent.contract.phases import Phase
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.stepping.cursor import Bookmark, PausedStep
from visup.stepping.history import StepHistory
from visup.stepping.observation_sources import ObservationSource


class Timeline:
    """An agent with its history, a position in it, and a source of further observations.

    Args:
        history: History of the agent.
        source: Source of observations; for a branch, its parent timeline.

    Attributes:
        agent: The agent, in its state at the position.
        parent: The timeline from which this one branched, or None.
    """

    def __init__(self, history: StepHistory, source: ObservationSource | Timeline) -> None:
        self.agent = history.agent
        self.parent = source if isinstance(source, Timeline) else None
        self._source = source if not isinstance(source, Timeline) else None
        self._history = history
        self._frame: Frame | None = None
        self._paused: PausedStep | None = None
        self._remaining_phases: Iterator[tuple[Phase, Outcome]] = iter(())
        self._last: Step | None = None

    # Position

    @property
    def mind(self) -> Mind:
        """The mind here; unfinished if stopped inside a step."""
        outcome = self._paused.outcome if self._paused else None
        return self.agent.mind if outcome is None else outcome.mind

    @property
    def at(self) -> int:
        """Number of steps before this position."""
        return self._history.at

    @property
    def made(self) -> int:
        """Total number of steps made."""
        return self._history.made

    @property
    def begin(self) -> int:
        """Number of steps before this timeline: 0 except for branches."""
        return self._history.begin

    @property
    def paused(self) -> PausedStep | None:
        """The step inside which it is stopped, or None."""
        return self._paused

    @property
    def last(self) -> Step | None:
        """The last completed step, or None at the beginning of the timeline."""
        return self._last

    # Forward

    def _cycle(self, phases: frozenset[Phase]) -> Step | None:
        """Run to the end of a step; None if stopped inside it, or if the source has ended."""
        before = self.agent.mind
        if self._paused is None:
            observation = self._perceived()
            if observation is None:
                return None
            self._paused, self._remaining_phases = (
                PausedStep(Phase.PERCEIVE, observation),
                self._history.phases(observation),
            )
            if Phase.PERCEIVE in phases:
                return None
        paused = self._paused
        for phase, outcome in self._remaining_phases:
            self._paused = paused = PausedStep(phase, paused.observation, outcome)
            if phase in phases:
                return None
        assert paused.outcome is not None
        step = self._history.conclude(paused.observation, paused.outcome)
        self._move_to(step)
        frame, self._frame = self._frame, None
        for observer in self.agent.observers if frame is not None else ():
            assert frame is not None
            observer(step, frame)
        self._after(before, step)
        return step

    def _after(self, before: Mind, step: Step) -> None:
        """Called for each completed step with the mind before it."""

    def _perceived(self) -> Observation | None:
        """The observation of the next step: stored, or new from the source."""
        history = self._history
        if history.at < len(history.observations):
            return history.observations.observation(history.at)
        if self.parent is not None:
            while len(history.observations) <= history.at:
                if not self.parent._extend():
                    return None
            if answers := self.parent._history.answers.get(history.at):
                history.answers[history.at] = answers
            return history.observations.observation(history.at)
        step_input = self._source.next(self.agent) if self._source else None
        if step_input is None:
            return None
        history.observations.add(step_input.observation)
        if step_input.answers is not None:
            history.answers[history.at] = step_input.answers
        self._frame = step_input.frame
        return step_input.observation

    def _extend(self) -> bool:
        """Extend this timeline by a step for a branch; the position is kept."""
        position = self._paused, self._remaining_phases, self._last
        made = self.made
        with self._history.position_kept():
            self._discard_unfinished()
            self._last = self._history.go(made)
            self._cycle(frozenset())
        self._paused, self._remaining_phases, self._last = position
        return self.made > made

    def _position_changed(self) -> None:
        """Called when the position has changed other than by a step."""

    def _move_to(self, step: Step | None) -> None:
        self._discard_unfinished()
        self._last = step

    def _discard_unfinished(self) -> None:
        """Discard the unfinished step, if any; its observation stays recorded."""
        self._paused, self._remaining_phases = None, iter(())

    # Back

    def back(self, n: int = 1) -> Step | None:
        """Go back by some steps; leaving an unfinished step counts as one.

        Returns:
            The step before the new position, or None at the beginning of the timeline.

        Raises:
            SettingsError: There are fewer steps.
        """
        number = self.at - n + (self._paused is not None)
        if number < self.begin:
            steps = self.at - self.begin + (self._paused is not None)
            words = "is no step" if n == 1 else f"are no {n} steps"
            raise SettingsError(f"there {words} to go back", expected=f"at most {steps}")
        return self.go(number)

    def go(self, number: int) -> Step | None:
        """Go to the state after step `number`; missing steps are made, and breakpoints are ignored.

        Raises:
            SettingsError: There is no such step; the position is kept.
        """
        if number < self.begin:
            raise SettingsError(
                f"there is no step {number}", expected=f"at least {self.begin}, where this began"
            )
        position = self.snapshot()
        self._move_to(self._history.go(min(number, self.made)))
        while self.at < number:
            if self._cycle(frozenset()) is None:
                self.restore(position)
                raise SettingsError(f"there is no step {number}", expected=f"at most {self.made}")
        self._position_changed()
        return self._last

    def go_to_time(self, seconds: float) -> Step | None:
        """Go to the state after the first step not before a time; missing steps are made.

        Raises:
            SettingsError: The source ends before; the position is kept.
        """
        before = self.snapshot()
        made = range(self.begin + 1, self.made + 1)
        index = bisect_left(made, seconds, key=lambda n: self.observation_at(n).time)
        self.go(made[index] if index < len(made) else self.made)
        while self.mind.time < seconds or self.at == self.begin:
            if self._cycle(frozenset()) is None:
                end = self.mind.time
                self.restore(before)
                raise SettingsError(
                    f"the source ends before {seconds:g} s", expected=f"at most {end:.2f} s"
                )
        self._position_changed()
        return self._last

    def snapshot(self) -> Bookmark:
        """This position, for `restore`; a few references, no copy."""
        return Bookmark(self.at, self._history.present, self._history)

    def restore(self, mark: Bookmark) -> None:
        """Return to the position of a snapshot.

        Raises:
            SettingsError: It is of another timeline.
        """
        if mark.history is not self._history:
            raise SettingsError(
                "this snapshot is of another timeline", expected="one of this stepper"
            )
        self._move_to(self._history.step(mark.number) if mark.number > self.begin else None)
        self._history.jump(mark.number, mark.snapshot)
        self._position_changed()

    # Past steps

    def at_step(self, number: int) -> Step | None:
        """A step without moving there; None at the beginning of the timeline.

        Raises:
            SettingsError: It was not made.
        """
        if not self.begin <= number <= self.made:
            raise SettingsError(
                f"there is no step {number}", expected=f"one from {self.begin} to {self.made}"
            )
        if number == self.at and self._last is not None:
            return self._last
        return self._history.step(number)

    def mind_at(self, number: int) -> Mind:
        """The mind after a step."""
        self.at_step(number)
        return self._history.snapshot(number).mind

    def events(self, first: int = 1, last: int | None = None) -> Iterator[tuple[int, Event]]:
        """All events so far, including those after this position, with the numbers of their steps."""
        return self._history.events(first, last)

    def observation_at(self, number: int) -> Observation:
        """The observation of a step; numbers begin at 1 and include the steps before a branch."""
        return self._history.observations.observation(number - 1)
