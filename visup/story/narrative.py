"""What is worth a line: tasks and alerts, named objects sparingly, one line per life of others.

Others are unidentified objects, and those of which only the class is known.

All events are recorded in any case; this is what people read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from visup.agent import Event, Frame, Mind, Severity
from visup.agent.model.step import Step
from visup.rules.wording.sentences import individual_name
from visup.story.life_sentences import course, lives_sentence, stay_sentence
from visup.story.line_budget import LineBudget
from visup.story.lives import LifeLog, ObjectLife
from visup.wording import EVENT_KINDS, worded_once

BRIEF_S = 0.8
"""Objects in view for less than this are counted in the summary only."""

SPECK = 0.0002
"""Objects that never cover more than this share of the picture are treated likewise."""

STAYS_S = 10.0
"""Objects in view for this long are reported while they are."""

PATIENCE_S = 15.0
"""A life that has found no line for this long is left to the summary."""

MIN_REPEAT_S, MIN_PAIR_REPEAT_S = 3.0, 10.0
"""Least time between two events of one kind about the same object, and the same pair, seconds."""

ABOUT_OBJECTS = frozenset(
    {
        *("entry", "noticed", "exit", "occlusion", "reappearance", "lost", "found"),
        *("coupled", "decoupled", "relation", "identified", "alert", "alert_closed"),
    }
)
"""Kinds of events that are reported for named objects only, and sparingly; all others always."""


class Detail(StrEnum):
    """Level of detail."""

    USUAL = "usual"
    ALL = "all"


@dataclass(slots=True)
class Narrative:
    """Chooses what to report. Pass it each step; it returns the lines to show.

    Events of tasks and alerts are always reported. So are those of actors, without repetitions;
    other named objects share a rate limit with the lives of all others.

    Attributes:
        detail: `ALL` reports every event, and no lives.
        log: The lives of all objects.
        budget: Rate limit of lines that are neither alerts nor about a task.
        withheld: Number of events that were not reported.
        courses: What objects did -> the ids of those that did it.
    """

    detail: Detail = Detail.USUAL
    log: LifeLog = field(default_factory=LifeLog)
    budget: LineBudget = field(default_factory=LineBudget)
    withheld: int = 0
    courses: dict[str, set[int]] = field(default_factory=dict)
    _waiting: list[ObjectLife] = field(default_factory=list)
    _staying: set[int] = field(default_factory=set)
    _told: dict[tuple[object, ...], float] = field(default_factory=dict)
    _alerts: set[object] = field(default_factory=set)
    _lives_told: int = 0

    def lines(self, step: Step, frame: Frame | None) -> list[Event]:
        """The lines of one step.

        Args:
            step: The step.
            frame: Its frame, for colours, or None.
        """
        self.budget.begin(step.time)
        ended = self.log.add(step, frame)
        if self.detail is Detail.ALL:
            return worded_once(step.events)
        told = [e for e in worded_once(step.events) if self._worth_telling(e, step.mind)]
        self.withheld += len(step.events) - len(told)
        self._waiting += self._counted(ended)
        return [*told, *self._lives(step)]

    def rest(self, time: float, frame_index: int) -> list[Event]:
        """The remaining lines when the run is over: lives that wait, and those that have not ended.

        Args:
            time: Of the last step, seconds.
            frame_index: Of its frame.
        """
        going_on = self._counted(self.log.finish())
        lives = [*self._waiting, *(x for x in going_on if x.id not in self._staying)]
        self._waiting = []
        if self.detail is Detail.ALL:
            return []
        groups = sorted(_by_course(lives), key=len, reverse=True)
        told = [g for g in groups if self.budget.take(time)]
        if not self._lives_told:
            told = told or groups[:1]  # however short the run, something is told of it
        return [_event(lives_sentence(g), g, time, frame_index) for g in told]

    def _counted(self, lives: Sequence[ObjectLife]) -> list[ObjectLife]:
        """The lives that count; what they did is counted whether reported or not."""
        found = [x for x in lives if _counts(x)]
        for life in found:
            self.courses.setdefault(course(life, "were"), set()).add(life.id)
        return found

    def _worth_telling(self, event: Event, mind: Mind) -> bool:
        if event.kind not in ABOUT_OBJECTS and event.kind in EVENT_KINDS:
            return True
        if event.kind not in EVENT_KINDS:
            return True  # a plug-in's own
        if event.severity > Severity.INFO:
            self._alerts.add(event.data.get("alert"))
            return True
        if event.kind == "alert_closed":
            return event.data.get("alert") in self._alerts
        if not event.objects or any(individual_name(mind, i) is None for i in event.objects):
            return False
        if not self._seldom(event):
            return False
        return set(event.objects) <= _actors(mind) or self.budget.take(event.time)

    def _seldom(self, event: Event) -> bool:
        key = event.kind, *sorted(event.objects)
        last, quiet = (
            self._told.get(key),
            MIN_PAIR_REPEAT_S if len(event.objects) > 1 else MIN_REPEAT_S,
        )
        if last is not None and event.time - last < quiet:
            return False
        self._told = {k: t for k, t in self._told.items() if event.time - t < MIN_PAIR_REPEAT_S}
        self._told[key] = event.time
        return True

    def _lives(self, step: Step) -> Iterator[Event]:
        """Lines on lives, as many as there may be now: those of the most numerous course first."""
        self._waiting = [x for x in self._waiting if step.time - x.until < PATIENCE_S]
        while self._waiting and self.budget.take(step.time):
            group = max(_by_course(self._waiting), key=lambda g: (len(g), max(x.area for x in g)))
            self._waiting = [x for x in self._waiting if x not in group]
            self._lives_told += 1
            yield _event(lives_sentence(group), group, step.time, step.frame_index)
        for life in self.log.alive.values():
            long = step.time - life.since >= STAYS_S and life.name is None and _counts(life)
            if long and life.id not in self._staying and self.budget.take(step.time):
                self._staying.add(life.id)
                self._lives_told += 1
                yield _event(stay_sentence(life), [life], step.time, step.frame_index)


def _actors(mind: Mind) -> set[int | None]:
    """The objects that play a part in a task."""
    return {b.object_id for task in mind.tasks for b in task.bindings}


def _counts(life: ObjectLife) -> bool:
    large = life.area >= SPECK * life.size[0] * life.size[1]
    return large and life.seconds >= BRIEF_S and life.name is None


def _by_course(lives: Sequence[ObjectLife]) -> list[list[ObjectLife]]:
    groups: dict[str, list[ObjectLife]] = {}
    for life in lives:
        groups.setdefault(course(life), []).append(life)
    return list(groups.values())


def _event(text: str, lives: Sequence[ObjectLife], time: float, frame_index: int) -> Event:
    return Event("life", time, frame_index, text, tuple(x.id for x in lives))
