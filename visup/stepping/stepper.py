"""The debugger of an agent: steps forward, back, inside a step, and into what-if branches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from visup.agent import Event, Frame, Mind
from visup.agent.contract.phases import Phase
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.agent.storage.jsonable import event_record
from visup.runs.replay import Transcript, TranscriptDiff, settings_for, transcript_diff
from visup.runs.wiring import final_verdict, reasoning_agent
from visup.stepping.breakpoint_parser import parse_condition
from visup.stepping.breakpoints import PhaseStop, Predicate, StopCondition
from visup.stepping.cursor import StepResult
from visup.stepping.diff import MindDiff, mind_diff
from visup.stepping.explanations import questions as asking
from visup.stepping.explanations.evidence import Why
from visup.stepping.explanations.why import ReasonFinder
from visup.stepping.explanations.why_not import LastStep
from visup.stepping.history import LATEST, SPACING, StepHistory
from visup.stepping.names import Names, known_names
from visup.stepping.observation_sources import (
    LiveObservations,
    ObservationSource,
    RecordedObservations,
)
from visup.stepping.timeline import Timeline
from visup.stepping.watch_expressions import Breakpoint, WatchExpression
from visup.stepping.what_if import Assumption, assuming_reasoners, with_assumptions, without_tasks


class Stepper(Timeline):
    """Steps an agent forward and back, stops at breakpoints, and inspects its mind.

    Args:
        agent: The agent, new or after any step; or a history of its steps to continue.
        frames: Frames for its behaviours; an `ObservationSource`, such as of a recorded run; or the
            timeline from which this one branches.
        spacing: Steps between stored minds; more means less memory and slower stepping back.
        latest: Number of cached steps.

    Attributes:
        breakpoints: Breakpoints by number.
        watches: Watches by number.
    """

    def __init__(
        self,
        agent: Agent | StepHistory,
        frames: Iterable[Frame] | ObservationSource | Timeline,
        *,
        spacing: int = SPACING,
        latest: int = LATEST,
    ) -> None:
        if isinstance(agent, Agent):
            agent = StepHistory(agent, spacing=spacing, latest=latest)
        if not isinstance(frames, ObservationSource | Timeline):
            frames = LiveObservations(frames)
        super().__init__(agent, frames)
        self.breakpoints: dict[int, Breakpoint] = {}
        self.watches: dict[int, WatchExpression] = {}
        self._extending = False

    @classmethod
    def of_run(cls, run: Path | Recording, **changed: Any) -> Stepper:
        """A stepper over the observations of a recorded run.

        Args:
            run: A run folder or its recording.
            changed: Settings of the run to change, as in `visup.runs.replay.settings_for`.

        Raises:
            VisupError: There is no such run, or a setting is not valid.
        """
        recording = run if isinstance(run, Recording) else Recording.open(run)
        return cls(
            reasoning_agent(settings_for(recording, **changed)), RecordedObservations(recording)
        )

    def step(
        self,
        n: int | None = None,
        until: str | Phase | Predicate | StopCondition | None = None,
        on_step: Callable[[Step], None] | None = None,
    ) -> StepResult:
        """Make some steps, or step until a condition holds; breakpoints also stop it.

        Args:
            n: Maximum number of steps; by default 1 without `until`, else unlimited. A step inside which it
                is stopped counts when it is completed.
            until: See `visup.stepping.breakpoint_parser.parse_condition`.
            on_step: Receives each completed step.

        Returns:
            Where and why it ended.

        Raises:
            SettingsError: `until` is not valid.
        """
        goals = (self._condition(until),) if until is not None else ()
        limit = n if n is not None or goals else 1
        stops = (*goals, *(b.stop for b in self.breakpoints.values() if b.enabled))
        phases = frozenset(s.phase for s in stops if isinstance(s, PhaseStop))
        done: list[Step] = []
        taken = 0
        while limit is None or taken < limit:
            before = self.agent.mind
            step = self._cycle(phases)
            if step is None:
                paused = self._paused
                why = (f"after {paused.phase.value}",) if paused else ()
                return StepResult(taken, tuple(done), why, paused, paused is None)
            taken += 1
            if on_step:
                on_step(step)
            done = [*done[1 - self._history.latest :], step]
            if reasons := self._reasons(goals, before, step):
                return StepResult(taken, tuple(done), reasons)
        return StepResult(taken, tuple(done))

    def _reasons(self, goals: Sequence[StopCondition], before: Mind, step: Step) -> tuple[str, ...]:
        """Reasons to stop after a step; every condition is evaluated, since some have state."""
        found = [s.met(before, step) for s in goals]
        for b in self.breakpoints.values():
            if b.enabled and (why := b.stop.met(before, step)):
                b.hits += 1
                found.append(f"breakpoint {b.id}: {why}")
        found += [w.changed(before, step) for w in self.watches.values()]
        return tuple(filter(None, found))

    def _after(self, before: Mind, step: Step) -> None:
        for watch in () if self._extending else tuple(self.watches.values()):
            watch.evaluate(before, step.mind)

    def _extend(self) -> bool:
        self._extending = True
        try:
            return super()._extend()
        finally:
            self._extending = False

    def _position_changed(self) -> None:
        for watch in self.watches.values() if self.mind.frame_index >= 0 else ():
            watch.evaluate(self.mind, self.mind)

    # Breakpoints and watches

    def break_at(self, what: str | Phase | Predicate | StopCondition) -> Breakpoint:
        """Set a breakpoint; see `visup.stepping.breakpoint_parser.parse_condition`."""
        breakpoint = Breakpoint(max(self.breakpoints, default=0) + 1, self._condition(what))
        self.breakpoints[breakpoint.id] = breakpoint
        return breakpoint

    @property
    def names(self) -> Names:
        """The known stages and rules, even before the first step."""
        return known_names(self.mind, self.agent.reasoners)

    def _condition(self, what: str | Phase | Predicate | StopCondition) -> StopCondition:
        return parse_condition(what, self.mind, self.names)

    def delete(self, number: int) -> None:
        """Delete a breakpoint.

        Raises:
            SettingsError: There is none of that number.
        """
        del self.breakpoints[self._breakpoint(number).id]

    def enable(self, number: int, enabled: bool = True) -> None:
        """Enable or disable a breakpoint.

        Raises:
            SettingsError: There is none of that number.
        """
        self._breakpoint(number).enabled = enabled

    def _breakpoint(self, number: int) -> Breakpoint:
        if number not in self.breakpoints:
            known = ", ".join(map(str, self.breakpoints)) or "none is set"
            raise SettingsError(f"there is no breakpoint {number}", expected=known)
        return self.breakpoints[number]

    def watch(self, text: str, *, breaks: bool = False) -> WatchExpression:
        """Evaluate an expression of the rule language after each step.

        Args:
            text: Such as `gap(1, 2)` or `touching(arm, satellite) for 1 s`.
            breaks: Whether to stop when its value changes.

        Raises:
            RuleError: It is not valid.
        """
        expression = WatchExpression.of(max(self.watches, default=0) + 1, text, breaks)
        if self.mind.frame_index >= 0:
            expression.evaluate(self.mind, self.mind)
        self.watches[expression.id] = expression
        return expression

    def unwatch(self, number: int) -> None:
        """Delete a watch.

        Raises:
            SettingsError: There is no watch of that number.
        """
        if self.watches.pop(number, None) is None:
            known = ", ".join(map(str, self.watches)) or "no watches are set"
            raise SettingsError(f"there is no watch {number}", expected=known)

    # Branches

    @property
    def can_answer(self) -> bool:
        """Whether the operator can answer here: at the end of a timeline that is not recorded."""
        return self.at == self.made and not isinstance(self._source, RecordedObservations)

    def answer(self, object_id: int, name: str) -> None:
        """Identify an object as the operator of this run; if steps follow, branch first.

        Raises:
            SettingsError: Later steps were made, or there is no such object or name.
        """
        if not self.can_answer:
            recorded = isinstance(self._source, RecordedObservations)
            other = "later steps were taken without this answer"
            what = "the operator of a recorded run can no longer answer" if recorded else other
            raise SettingsError(what, hint="branch, and answer there")
        self.agent.answer(object_id, name)

    def branch(self, *assumptions: Assumption, reasoners: Reasoners | None = None) -> Stepper:
        """A branch from here under some assumptions; this timeline is not changed.

        It has the same observations; at their end, this timeline is extended ahead of its position.

        Args:
            assumptions: Enforced in every step of the branch, from `visup.stepping.what_if`.
            reasoners: Reasoners of the branch; by default the same.
        """
        reasoners = reasoners or self.agent.reasoners
        other = replace_agent(self.agent, assuming_reasoners(reasoners, assumptions))
        present = self._history.present
        tasks_changed = reasoners.match != self.agent.reasoners.match
        mind = with_assumptions(
            without_tasks(present.mind) if tasks_changed else present.mind, assumptions
        )
        other.restore(replace(present, mind=mind))
        branched = Stepper(self._history.branch(other), self)
        branched._last = self._last
        return branched

    def compare(self) -> TranscriptDiff:
        """The difference of events between this branch and its parent over the same steps.

        Returns:
            Events of only the parent, of only this branch, and both verdicts here.

        Raises:
            SettingsError: This is no branch.
        """
        parent = self.parent
        if parent is None:
            raise SettingsError("this is not a branch: there is nothing to compare it with")
        while parent.made < self.at and parent._extend():
            continue  # the parent was stopped inside a step that this branch has made
        first, last = self.begin + 1, self.at
        return transcript_diff(
            _transcript(parent.events(first, last), parent.mind_at(last)),
            _transcript(self.events(first, last), self.mind_at(last)),
        )

    def diff(self, first: int, second: int | None = None) -> MindDiff:
        """The differences between the minds after two steps; the second is here by default."""
        after = self.mind if second is None else self.mind_at(second)
        return mind_diff(self.mind_at(first), after)

    # Explanations

    def why(self, what: object) -> Why:
        """Explain something at this step: a tree of reasons, down to percepts and their frames.

        Args:
            what: An alert, event, relation, coupling, object, stage or task belief; or text, such as
                `alert 2`, `touching 1 2`, `identity 1`, `captured`, `verdict`.

        Raises:
            VisupError: It cannot be explained.
        """
        reasons = ReasonFinder(self, self.at, self.mind)
        return asking.why(reasons, what) if isinstance(what, str) else reasons.of(what)

    def why_not(self, text: str) -> Why:
        """Why something has not happened: unmet conditions with their margins.

        Args:
            text: Such as `coupled 1 2`, `collision_course`, `stage captured`, `entry 3`, `identified 1`.

        Raises:
            VisupError: It cannot be explained.
        """
        stepped = self.at > self.begin
        before = self.mind_at(self.at - 1) if stepped else None
        observation = self.observation_at(self.at) if stepped else None
        return asking.why_not(
            LastStep(self.mind, before, observation, tuple(self.agent.reasoners)), text
        )

    def close(self) -> None:
        """Release the resources of the agent's behaviours."""
        self.agent.close()


def _transcript(events: Iterator[tuple[int, Event]], mind: Mind) -> Transcript:
    verdict = final_verdict(mind).value if mind.tasks else None
    return Transcript(tuple(event_record(e) for _, e in events), verdict, mind.frame_index)


def replace_agent(agent: Agent, reasoners: Reasoners) -> Agent:
    """The same agent with other reasoners and without behaviours."""
    return Agent(
        reasoners=reasoners,
        actors=agent.actors,
        zones=agent.zones,
        models=agent.models,
        cast=agent.cast,
    )
