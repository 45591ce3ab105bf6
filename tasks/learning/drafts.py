"""A task during induction: its course, its further requirements, and its text with the evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, floor, inf

from visup.tasks.analysis.judging import JudgedRun
from visup.tasks.grammar.nodes import Actor
from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import (
    STAYING_NEAR,
    CarryingStage,
    Conjunction,
    Disjunction,
    Item,
    Loop,
    LoopCounts,
    Occurrence,
    Plan,
    Proximity,
    Series,
    Unordered,
    action_text,
    final_of,
    leaves_of,
    symbols_of,
)
from visup.tasks.learning.periods import Period, course_of
from visup.tasks.learning.places import PLACED_S, FinalPlace, Release
from visup.tasks.learning.precedence import Precedence, invariants
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.rests import FinalRest, RestingActor
from visup.tasks.learning.traces import LONGEST_BRIDGED_GAP_S, RunTrace, Symbol

STAGE_NAMES = {
    "converging": "approach",
    "coupled": "couple",
    "touching": "contact",
    "decoupled": "release",
    "diverging": "retreat",
    "moving_together": "carry",
    "apart": "part",
    STAYING_NEAR: "keep",
}
MARGIN = 3.0
"""Deadline of a stage as a multiple of its longest duration in a good run."""
MIN_DEADLINE_S = 10.0
HOLD_SHARE = 0.5
LONGEST_HOLD_S = 6.0
"""The last stage must hold for `HOLD_SHARE` of its shortest duration, capped at `LONGEST_HOLD_S`."""
STAY_STAGE = "stay"
"""Name of the stage in which the actors of the last contact stay in place."""
REST_SHARE = 0.65
"""An actor that comes to rest must rest for this share of the shortest rest in a good run, capped
likewise."""
COMPLETE = (*MEETINGS, "moving_together", "diverging")
"""Last events that are complete when they end or have lasted: no later event terminates them."""
LONGEST_RETREAT_S = 1.0
"""Cap of the least duration of a final retreat: recordings end soon after it."""


@dataclass
class Draft:
    """A task during induction.

    Attributes:
        name: Of the task.
        plan: Its course.
        loop_counts: Least and greatest number of iterations of each loop.
        runs: Good runs.
        rows: The events of each run.
        declared: Actors as the runs' own tasks declare them.
        forbidden: Symbols that must never occur.
        last_stage_holds: Whether the last stage must hold for a while.
        carrying_may_fail: Whether a stage of carrying fails when the two come apart.
        periods: The periodic loops.
        resting_actors: Actors that must not be pushed.
        precedences: Contacts that must not come too early.
        places: Final places of the actors in contact.
        final_rest: The actor that comes to rest in the last stage.
        release: The release with which it ends.
        judged_runs: (its text, id of a run) -> what that text makes of the run.
    """

    name: str
    plan: Plan
    loop_counts: LoopCounts
    runs: Sequence[RunTrace]
    rows: Sequence[Sequence[CourseEvent]]
    declared: Mapping[str, Actor]
    forbidden: list[Symbol] = field(default_factory=list)
    last_stage_holds: bool = True
    carrying_may_fail: bool = True
    periods: dict[Loop, Period] = field(default_factory=dict)
    resting_actors: tuple[RestingActor, ...] = ()
    precedences: tuple[Precedence, ...] = ()
    places: tuple[FinalPlace, ...] = ()
    final_rest: FinalRest | None = None
    release: Release | None = None
    judged_runs: dict[tuple[str, int], JudgedRun] = field(default_factory=dict)

    def text(self) -> str:
        """The task file."""
        names = stage_names(self.plan)
        lines = [f"# {self.name}: learned from {runs_text(len(self.runs))}"]
        staying = self._stay_stage()
        # The retreat is optional where a stage after it requires what lasts.
        last = ("?" if self.release is not None else "") + (f" <{STAY_STAGE}>" if staying else "")
        course = _course(self.plan, names) + last
        lines.append(f"<{self.name}> ::= {course}")
        lines += [self._stage(o, name) for o, name in names.items()]
        lines += [staying] if staying else []
        lines += [str(self.declared[a]) for a in self.actors() if a in self.declared]
        lines += [
            f"never {action_text(s)}  # in no good run, and in a bad one" for s in self.forbidden
        ]
        seen = f"  # in {all_runs_text(len(self.runs))}"
        lines += [line + seen for line in invariants(self.precedences, names)]
        early = [p for p in self.places if not (p.of_last or self.release)]
        lines += [p.invariant(names[p.stage], all_runs_text(len(self.runs))) for p in early]
        lines += [rest.invariant(all_runs_text(len(self.runs))) for rest in self.resting_actors]
        return "\n".join(lines) + "\n"

    def actors(self) -> list[str]:
        """Its actors, sorted."""
        symbols = [s for o in leaves_of(self.plan) for s in symbols_of(o[0])]
        return sorted({a for _, actors in (*symbols, *self.forbidden) for a in actors})

    def _stage(self, occurrence: Occurrence, name: str) -> str:
        item = occurrence[0]
        if isinstance(item, Loop) and item in self.periods:
            return f"<{name}> ::= {course_of(item, self.periods[item])}"
        if isinstance(item, Loop):
            least, most = self.loop_counts[item]
            body = " ".join(map(_part_text, item.body))
            count_text = f"{least} to {most} times in a row"
            return (
                f"<{name}> ::= ({body}) at least {least} times at most {most} times  # {count_text}"
            )
        spans = self._spans(occurrence)
        seen = f"in {len(spans)} of {runs_text(len(self.runs))}"
        if isinstance(item, Proximity):
            return f"<{name}> ::= {action_text(item)} for {item.least_s:g} s  # {seen}"
        if not spans or (self._is_last(occurrence) and not self._final_facts()):
            hold_s = self._least_hold_s(occurrence) if self._is_last(occurrence) else 0.0
            course = self._stage_body(occurrence, f" for {hold_s:g} s" if hold_s else "")
            return f"<{name}> ::= {course}  # {seen}"
        duration_text = f"{min(spans):.1f} to {max(spans):.1f} s"
        if self.release is not None and self._is_last(occurrence):
            return f"<{name}> ::= {action_text(item)}  # {seen}"
        course = self._stage_body(occurrence, f" within {deadline(spans)} s")
        return f"<{name}> ::= {course}  # {seen}, {duration_text}"

    def _stage_body(self, occurrence: Occurrence, clause: str) -> str:
        """The body of a stage, with a clause of time."""
        item = occurrence[0]
        already = self._held_from_start(occurrence) or self._may_begin_early(occurrence)
        if isinstance(item, CarryingStage):
            return f"({action_text(item)}){clause}{self._carrying_failure(item)}"
        if isinstance(item, Disjunction):
            word = "already " if already else ""
            return " | ".join(f"{word}{action_text(part)}{clause}" for part in item.parts)
        action = action_text(item)
        if self.release is not None and item == self.release.symbol:
            # After a release the two are apart, too, which may be observed before or after it.
            return f"{action}{clause} | {action_text(('apart', item[1]))}{clause}"
        if isinstance(item, Conjunction) and (clause or already):
            action = f"({action})"
        return f"{'already ' if already else ''}{action}{clause}"

    def _final_facts(self) -> list[str]:
        """Requirements of the last stage besides its contact: shared outlines, and an actor at rest."""
        places = (p for p in self.places if p.of_last or self.release is not None)
        found = [f"{p.quantity} > {p.least} %" for p in places]
        return found + ([self.final_rest.fact] if self.final_rest is not None else [])

    def _stay_stage(self) -> str:
        """A stage after the last contact that requires the final facts; empty if there are none."""
        final, facts = final_of(self.plan), self._final_facts()
        if self.release is not None:
            # A shared outline implies contact, even while a third actor moves there.
            placed_contacts = {p.contact for p in self.places}
            lasting = [s for s in self.release.lasting_contacts if s not in placed_contacts]
            facts_text = " & ".join([*map(action_text, lasting), *facts])
            # It may hold already when the retreat is observed.
            facts_text = f"({facts_text})" if " & " in facts_text else facts_text
            body = f"already {facts_text} for {PLACED_S:g} s"
            return f"<{STAY_STAGE}> ::= {body}  # in {all_runs_text(len(self.runs))}"
        if final is None or not facts:
            return ""
        hold_s = self._least_hold_s(final)
        clause = f" for {hold_s:g} s" if hold_s else ""
        facts_text = " & ".join([action_text(final[0]), *facts])
        return f"<{STAY_STAGE}> ::= ({facts_text}){clause}  # in {all_runs_text(len(self.runs))}"

    def _carrying_failure(self, item: CarryingStage) -> str:
        """The condition under which carrying fails: the two are apart for longer than relations flicker."""
        separated = action_text(("apart", item.parts[0][1]))
        return (
            f" fails when {separated} for {LONGEST_BRIDGED_GAP_S:g} s"
            if self.carrying_may_fail
            else ""
        )

    def _is_last(self, occurrence: Occurrence) -> bool:
        plan = self.plan
        while isinstance(plan, Series):
            plan = plan.parts[-1]
        return occurrence in leaves_of(plan)

    def _held_from_start(self, occurrence: Occurrence) -> bool:
        """Whether an event held from the start of some run, as far as was observed."""
        found = [event_of(row, occurrence) for row in self.rows]
        return any(e is not None and not e.interval.begin_observed for e in found)

    def _may_begin_early(self, occurrence: Occurrence) -> bool:
        """Whether a lasting meeting is one of several in any order, so that it may begin during others."""
        if occurrence not in _single_parts(self.plan):
            return False
        found = [event_of(row, occurrence) for row in self.rows]
        return all(e is not None and e.lasts_to_end and e.symbol[0] in MEETINGS for e in found)

    def _least_hold_s(self, occurrence: Occurrence) -> float:
        """How long the last event must hold, seconds; 0 if it does not last to the end."""
        if not self.last_stage_holds:
            return 0.0
        found = [event_of(row, occurrence) for row in self.rows]
        # A meeting is complete when it ends or has lasted: no later event terminates it.
        if not all(e is not None and (e.lasts_to_end or e.symbol[0] in COMPLETE) for e in found):
            return 0.0
        shortest = min(e.interval.end - e.interval.begin for e in found if e is not None)
        if self.final_rest is not None:
            return floor(2 * REST_SHARE * min(self.final_rest.rested_s, LONGEST_HOLD_S)) / 2
        drawing_back = any(e is not None and e.symbol[0] == "diverging" for e in found)
        most = LONGEST_RETREAT_S if drawing_back else LONGEST_HOLD_S
        return max(0.0, floor(2 * HOLD_SHARE * min(shortest, most)) / 2)

    def _spans(self, occurrence: Occurrence) -> list[float]:
        """Greatest duration of a stage in each run: from the event before it to the event after it.

        A stage that completes by itself (a contact) lets the next one begin at once, so the time of the
        next counts from there.
        """
        course = leaves_of(self.plan)
        found = []
        for run, row in zip(self.runs, self.rows, strict=True):
            begins = {o: t for o in course if (t := begin_of(row, o)) is not None}
            own_begin = begins.pop(occurrence, None)
            if own_begin is None:
                continue
            earlier = [t for t in begins.values() if t < own_begin]
            later = [t for t in begins.values() if t > own_begin]
            found.append(min(later, default=own_begin) - max(earlier, default=run.begin))
        return found


def _single_parts(plan: Plan) -> list[Occurrence]:
    """The stages that are by themselves one of several in any order."""
    if isinstance(plan, Series):
        return [o for p in plan.parts for o in _single_parts(p)]
    if isinstance(plan, Unordered):
        return [p for p in plan.parts if not isinstance(p, Series | Unordered)]
    return []


def stage_names(plan: Plan) -> dict[Occurrence, str]:
    """A unique name for each stage: its action, then its actors, then a number."""
    occurrences = leaves_of(plan)
    plain = [_action_name(o[0]) for o in occurrences]
    found: dict[Occurrence, str] = {}
    for occurrence, word in zip(occurrences, plain, strict=True):
        name = word if plain.count(word) == 1 else f"{word}_{_actor_names(occurrence[0])}"
        number = 2
        unique = name
        while unique in found.values():
            unique, number = f"{name}_{number}", number + 1
        found[occurrence] = unique
    return found


def event_of(row: Sequence[CourseEvent], occurrence: Occurrence) -> CourseEvent | None:
    """The event of an occurrence in a run, or None."""
    item, number = occurrence
    first = item
    while isinstance(first, Loop):
        first = first.body[0]
    found = [e for e in row if e.item == first]
    return found[number] if number < len(found) else None


def begin_of(row: Sequence[CourseEvent], occurrence: Occurrence) -> float | None:
    """When an occurrence began in a run, seconds, or None."""
    found = event_of(row, occurrence)
    return None if found is None else found.interval.begin


def deadline(spans: Sequence[float]) -> int:
    """A deadline with margin, in whole seconds; from 20 s on in multiples of 5."""
    raw = max(MIN_DEADLINE_S, MARGIN * max(spans, default=inf))
    return ceil(raw) if raw < 20 else 5 * ceil(raw / 5)


def _course(plan: Plan, names: Mapping[Occurrence, str]) -> str:
    if isinstance(plan, Series):
        return " ".join(_course(p, names) for p in plan.parts)
    if isinstance(plan, Unordered):
        return f"any order ({', '.join(_course(p, names) for p in plan.parts)})"
    return f"<{names[plan]}>"


def _part_text(item: Item) -> str:
    """A part of a loop as text, a group in brackets."""
    text = action_text(item)
    return text if isinstance(item, tuple | Loop) else f"({text})"


def _action_name(item: Item) -> str:
    if isinstance(item, Loop):
        return "repeat"
    if isinstance(item, CarryingStage):
        return STAGE_NAMES["moving_together"]
    words = [STAGE_NAMES.get(action, action) for action, _ in symbols_of(item)]
    return "_and_".join(dict.fromkeys(words))


def _actor_names(item: Item) -> str:
    return "_".join(dict.fromkeys(a for _, actors in symbols_of(item) for a in actors))


def all_runs_text(count: int) -> str:
    """All of some runs: `3 of 3 runs`."""
    return f"{count} of {runs_text(count)}"


def runs_text(count: int) -> str:
    """A number of runs: `3 runs`."""
    return f"{count} {'run' if count == 1 else 'runs'}"
