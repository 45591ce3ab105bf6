"""The debugger of an agent: forth, back, inside a step, and aside into what might have been."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from visup.agent import Event, Frame, Mind, Observation, Outcome
from visup.agent.agent import Agent, Step, Thinkers
from visup.agent.encode import event_line
from visup.agent.errors import SettingsError
from visup.agent.phases import Phase, Snapshot
from visup.agent.recording import Recording
from visup.replay import Difference, Told, settings_for
from visup.replay import difference as told_difference
from visup.stepping import asking
from visup.stepping.diff import MindDiff, difference
from visup.stepping.evidence import Why
from visup.stepping.feeds import Feed, LiveFeed, RecordedFeed
from visup.stepping.history import LATEST, SPACING, History
from visup.stepping.stops import PhaseStop, Predicate, Stop, stop_of
from visup.stepping.watching import Breakpoint, Watch
from visup.stepping.whatif import Belief, insisted, insisting, without_tasks
from visup.stepping.why import Reasons
from visup.supervisor import final_verdict, reasoning_agent


@dataclass(frozen=True, slots=True, eq=False)
class Midway:
    """A step that is stopped inside its cycle.

    Attributes:
        phase: The phase that is over.
        seen: What was perceived.
        thought: What was concluded so far; its mind is half-made. None after `perceive`.
    """

    phase: Phase
    seen: Observation
    thought: Outcome | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Stopped:
    """Where and why a run of steps ended.

    Attributes:
        taken: How many steps were completed.
        steps: The latest of them, at most `LATEST`.
        reasons: Which conditions were met; empty when the number of steps was made.
        midway: The step inside which it stopped, or None.
        ended: Whether there is nothing more to perceive.
    """

    taken: int
    steps: tuple[Step, ...] = ()
    reasons: tuple[str, ...] = ()
    midway: Midway | None = None
    ended: bool = False

    @property
    def step(self) -> Step | None:
        """The last step that was completed."""
        return self.steps[-1] if self.steps else None


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """A place to go back to, from `Stepper.snapshot`.

    Attributes:
        number: How many steps led there.
        was: What the agent was.
        course: The history that it belongs to.
    """

    number: int
    was: Snapshot
    course: History = field(repr=False)


class Stepper:
    """Steps an agent forth and back, stops where it is told to, and looks into its mind.

    Args:
        agent: The agent, new or after any step.
        frames: Frames for its behaviours; or a `Feed`, such as of a recorded run.
        spacing: Steps between two minds that are kept; more of them is less to keep and longer to
            go back.
        latest: How many steps are kept whole.

    Attributes:
        agent: The agent; its mind is that of the place.
        breakpoints: By their number.
        watches: By their number.
        parent: The course that this one branched off, or None.
    """

    def __init__(
        self,
        agent: Agent,
        frames: Iterable[Frame] | Feed,
        *,
        spacing: int = SPACING,
        latest: int = LATEST,
    ) -> None:
        self._begin(History(agent, spacing=spacing, latest=latest), None)
        self._feed: Feed = frames if isinstance(frames, Feed) else LiveFeed(frames)

    def _begin(self, history: History, parent: Stepper | None) -> None:
        self.agent = history.agent
        self.parent = parent
        self.breakpoints: dict[int, Breakpoint] = {}
        self.watches: dict[int, Watch] = {}
        self._history = history
        self._frame: Frame | None = None
        self._midway: Midway | None = None
        self._rest: Iterator[tuple[Phase, Outcome]] = iter(())
        self._last: Step | None = None

    @classmethod
    def of_run(cls, run: Path | Recording, **changed: Any) -> Stepper:
        """A stepper over what a run perceived; nothing is seen again.

        Args:
            run: A run folder or its recording.
            changed: Settings of the run to change, as of `visup.replay.settings_for`.

        Raises:
            VisupError: There is no such run, or a setting is not as it should be.
        """
        recording = run if isinstance(run, Recording) else Recording.open(run)
        return cls(reasoning_agent(settings_for(recording, **changed)), RecordedFeed(recording))

    # Where it is

    @property
    def mind(self) -> Mind:
        """What is believed here; half-made when stopped inside a step."""
        thought = self._midway.thought if self._midway else None
        return self.agent.mind if thought is None else thought.mind

    @property
    def at(self) -> int:
        """How many steps led here."""
        return self._history.at

    @property
    def made(self) -> int:
        """How many steps were ever made."""
        return self._history.made

    @property
    def begin(self) -> int:
        """How many steps there were before this course: 0 but for branches."""
        return self._history.begin

    @property
    def midway(self) -> Midway | None:
        """The step inside which it is stopped, or None."""
        return self._midway

    @property
    def last(self) -> Step | None:
        """The last completed step, or None where the course begins."""
        return self._last

    # Forth

    def step(
        self, n: int | None = None, until: str | Phase | Predicate | Stop | None = None
    ) -> Stopped:
        """Go on by some steps, or until something is so; breakpoints end it, too.

        Args:
            n: How many steps at most; 1 when `until` is left out, else as many as there are. A step
                inside which it is stopped counts when it is completed.
            until: See `visup.stepping.stops.stop_of`.

        Returns:
            Where and why it ended.

        Raises:
            SettingsError: Nothing is meant by `until`.
        """
        goal = (stop_of(until, self.mind),) if until is not None else ()
        most = n if n is not None or goal else 1
        stops = (*goal, *(b.stop for b in self.breakpoints.values() if b.enabled))
        phases = frozenset(s.phase for s in stops if isinstance(s, PhaseStop))
        done: list[Step] = []
        taken = 0
        while most is None or taken < most:
            before = self.agent.mind
            step = self._cycle(phases)
            if step is None:
                halted = self._midway
                why = (f"after {halted.phase.value}",) if halted else ()
                return Stopped(taken, tuple(done), why, halted, halted is None)
            taken += 1
            done = [*done[1 - self._history.latest :], step]
            if reasons := self._reasons(goal, before, step):
                return Stopped(taken, tuple(done), reasons)
        return Stopped(taken, tuple(done))

    def _cycle(self, phases: frozenset[Phase]) -> Step | None:
        """On to the end of a step, or None: stopped inside it, or nothing more is perceived."""
        before = self.agent.mind
        if self._midway is None:
            seen = self._perceived()
            if seen is None:
                return None
            self._midway, self._rest = Midway(Phase.PERCEIVE, seen), self._history.phases(seen)
            if Phase.PERCEIVE in phases:
                return None
        midway = self._midway
        for phase, thought in self._rest:
            self._midway = midway = Midway(phase, midway.seen, thought)
            if phase in phases:
                return None
        assert midway.thought is not None
        step = self._history.conclude(midway.seen, midway.thought)
        self._arrive(step)
        frame, self._frame = self._frame, None
        for observer in self.agent.observers if frame is not None else ():
            assert frame is not None
            observer(step, frame)
        for watch in self.watches.values():
            watch.look(before, step.mind)
        return step

    def _perceived(self) -> Observation | None:
        """What the next step begins with: from the tape, or new."""
        tape, at = self._history.tape, self._history.at
        if at < len(tape) or self._extend():
            return tape.seen(at)
        return None

    def _extend(self) -> bool:
        """Perceive once more; whether there was anything."""
        history = self._history
        if self.parent is not None:
            there = self.parent._look_ahead()
            said = self.parent._history.answers.get(history.at)
            history.answers |= {history.at: said} if there and said else {}
            return there
        given = self._feed.next(self.agent)
        if given is None:
            return False
        history.tape.add(given.seen)
        if given.answers is not None:
            history.answers[len(history.tape) - 1] = given.answers
        self._frame = given.frame
        return True

    def _look_ahead(self) -> bool:
        """One more step at the end of this course, for a branch; the place stays."""
        paused = self._midway, self._rest, self._last
        made = self.made
        with self._history.elsewhere():
            self._drop()
            self._last = self._history.go(made)
            self.watches, watches = {}, self.watches
            self._cycle(frozenset())
            self.watches = watches
        self._midway, self._rest, self._last = paused
        return self.made > made

    def _reasons(self, goal: Sequence[Stop], before: Mind, step: Step) -> tuple[str, ...]:
        """Why to stop after a step; every condition is asked, for some remember."""
        found = [s.met(before, step) for s in goal]
        for b in self.breakpoints.values():
            if b.enabled and (why := b.stop.met(before, step)):
                b.hits += 1
                found.append(f"breakpoint {b.id}: {why}")
        found += [w.changed(before, step) for w in self.watches.values()]
        return tuple(filter(None, found))

    def _look_again(self) -> None:
        """Watches show what is so here."""
        for watch in self.watches.values() if self.mind.frame_index >= 0 else ():
            watch.look(self.mind, self.mind)

    def _arrive(self, step: Step | None) -> None:
        self._drop()
        self._last = step

    def _drop(self) -> None:
        """Forget the half-made step, if there is one; what was perceived stays on the tape."""
        self._midway, self._rest = None, iter(())

    # Back

    def back(self, n: int = 1) -> Step | None:
        """Go back by some steps; a step inside which it is stopped is left, and counts as one.

        Returns:
            The step after which it is now, or None where the course begins.
        """
        return self.go(self.at - n + (self._midway is not None))

    def go(self, number: int) -> Step | None:
        """Be after step `number`; later ones are made if need be, and breakpoints are not looked at.

        Raises:
            SettingsError: There is no such step.
        """
        if number < self.begin:
            raise SettingsError(
                f"there is no step {number}", expected=f"at least {self.begin}, where this began"
            )
        self._arrive(self._history.go(min(number, self.made)))
        while self.at < number:
            if self._cycle(frozenset()) is None:
                raise SettingsError(f"there is no step {number}", expected=f"at most {self.made}")
        self._look_again()
        return self._last

    def snapshot(self) -> Mark:
        """This place, to come back to with `restore`; a few references, no copy."""
        return Mark(self.at, self._history.here, self._history)

    def restore(self, mark: Mark) -> None:
        """Be again where a snapshot was taken.

        Raises:
            SettingsError: It is of another course.
        """
        if mark.course is not self._history:
            raise SettingsError(
                "this snapshot is of another course", expected="one of this stepper"
            )
        self._arrive(self._history.step(mark.number) if mark.number > self.begin else None)
        self._history.jump(mark.number, mark.was)
        self._look_again()

    def at_step(self, number: int) -> Step | None:
        """A step that was made, without going there; None where the course begins.

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
        """The mind after a step that was made."""
        self.at_step(number)
        return self._history.snapshot(number).mind

    def told(self, first: int = 1, last: int | None = None) -> Iterator[tuple[int, Event]]:
        """Number of the step and event, for all that was told so far, also after this place."""
        return self._history.told(first, last)

    # Where to stop, what to watch

    def break_at(self, what: str | Phase | Predicate | Stop) -> Breakpoint:
        """Set a breakpoint; see `visup.stepping.stops.stop_of`."""
        made = Breakpoint(max(self.breakpoints, default=0) + 1, stop_of(what, self.mind))
        self.breakpoints[made.id] = made
        return made

    def delete(self, number: int) -> None:
        """Delete a breakpoint.

        Raises:
            SettingsError: There is none of that number.
        """
        del self.breakpoints[self._breakpoint(number).id]

    def enable(self, number: int, enabled: bool = True) -> None:
        """Look at a breakpoint again, or no longer.

        Raises:
            SettingsError: There is none of that number.
        """
        self._breakpoint(number).enabled = enabled

    def _breakpoint(self, number: int) -> Breakpoint:
        if number not in self.breakpoints:
            known = ", ".join(map(str, self.breakpoints)) or "none is set"
            raise SettingsError(f"there is no breakpoint {number}", expected=known)
        return self.breakpoints[number]

    def watch(self, text: str, *, breaks: bool = False) -> Watch:
        """Judge an expression of the rule language after each step.

        Args:
            text: Such as `gap(1, 2)` or `touching(arm, satellite) for 1 s`.
            breaks: Whether steps end when what it shows changes.

        Raises:
            RuleError: It cannot be read.
        """
        made = Watch.of(max(self.watches, default=0) + 1, text, breaks)
        if self.mind.frame_index >= 0:
            made.look(self.mind, self.mind)
        self.watches[made.id] = made
        return made

    def unwatch(self, number: int) -> None:
        """No longer judge an expression.

        Raises:
            SettingsError: There is no watch of that number.
        """
        if self.watches.pop(number, None) is None:
            known = ", ".join(map(str, self.watches)) or "nothing is watched"
            raise SettingsError(f"there is no watch {number}", expected=known)

    # Aside

    def answer(self, object_id: int, name: str) -> None:
        """Say what an object is, as the operator of this run; where steps follow, branch first.

        Raises:
            SettingsError: Later steps were made, or nobody knows such an object or name.
        """
        recorded = self.parent is None and isinstance(self._feed, RecordedFeed)
        if recorded or self.at < self.made:
            what = (
                "the operator of a recorded run has spoken"
                if recorded
                else ("later steps were made without this answer")
            )
            raise SettingsError(what, hint="branch, and answer there")
        self.agent.answer(object_id, name)

    def branch(self, *beliefs: Belief, thinkers: Thinkers | None = None) -> Stepper:
        """Another course from here on, with what is insisted upon; this one stays as it is.

        It perceives the very same; when it comes to the end of what was perceived, this course goes
        on by itself, ahead of its place.

        Args:
            beliefs: To be held in every step of the branch whatever is seen, from `visup.stepping.whatif`.
            thinkers: What reasons there; as here when left out.
        """
        thinkers = thinkers or self.agent.thinkers
        other = replace_agent(self.agent, insisting(thinkers, beliefs))
        here = self._history.here
        swapped = thinkers.match != self.agent.thinkers.match
        mind = insisted(without_tasks(here.mind) if swapped else here.mind, beliefs)
        other.restore(replace(here, mind=mind))
        history = self._history
        course = History(
            other,
            history.tape,
            self.at,
            {n: said for n, said in history.answers.items() if n >= self.at},
            history.spacing,
            history.latest,
        )
        made = object.__new__(Stepper)
        made._begin(course, self)
        made._last = self._last
        return made

    def compare(self) -> Difference:
        """What this branch tells differently from the course that it left, over the same steps.

        Returns:
            Events that only the course told, and only this branch told; and both verdicts here.

        Raises:
            SettingsError: This is no branch.
        """
        parent = self.parent
        if parent is None:
            raise SettingsError("this is no branch: there is nothing to compare it with")
        while parent.made < self.at and parent._look_ahead():
            pass
        first, last = self.begin + 1, self.at
        return told_difference(
            _told(parent.told(first, last), parent.mind_at(last)),
            _told(self.told(first, last), self.mind_at(last)),
        )

    def diff(self, first: int, second: int | None = None) -> MindDiff:
        """What differs between the minds after two steps; the second one is here when left out."""
        there = self.mind if second is None else self.mind_at(second)
        return difference(self.mind_at(first), there)

    # Why

    def seen_at(self, number: int) -> Observation:
        """What was perceived in a step; numbers begin at 1, with what was seen before any branch."""
        return self._history.tape.seen(number - 1)

    def why(self, what: object) -> Why:
        """Why something is so here: a tree of reasons, down to percepts and their frames.

        Args:
            what: An alert, event, relation, coupling, object, stage or task belief; or text, such as
                `alert 2`, `touching 1 2`, `identity 1`, `captured`, `verdict`.

        Raises:
            VisupError: Nothing is known of it.
        """
        reasons = Reasons(self, self.at, self.mind)
        return asking.why(reasons, what) if isinstance(what, str) else reasons.of(what)

    def why_not(self, text: str) -> Why:
        """Why something has not happened: conditions that are not met, and by how much.

        Args:
            text: Such as `coupled 1 2`, `collision_course`, `stage captured`, `entry 3`, `identified 1`.

        Raises:
            VisupError: Nothing is known of it.
        """
        thinkers = self.agent.thinkers
        every = (*thinkers.update, *thinkers.cogitate, *thinkers.match)
        return asking.why_not(self.mind, every, text)

    def close(self) -> None:
        """Let go of what the agent's behaviours have started."""
        with suppress(AttributeError):
            self.agent.close()


def _told(events: Iterator[tuple[int, Event]], mind: Mind) -> Told:
    verdict = final_verdict(mind).value if mind.tasks else None
    return Told(tuple(event_line(e) for _, e in events), verdict, mind.frame_index)


def replace_agent(agent: Agent, thinkers: Thinkers) -> Agent:
    """An agent that reasons with other thinkers, and perceives nothing."""
    return Agent(thinkers=thinkers, actors=agent.actors, zones=agent.zones, models=agent.models)
