"""A task during induction: its course, what is required besides, and its text with the evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, floor, inf

from visup.tasks.grammar.nodes import Actor
from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import (
    KEEPING,
    Carry,
    Either,
    Free,
    Item,
    Joint,
    Keep,
    Loop,
    Occurrence,
    Plan,
    Series,
    Times,
    action_text,
    final_of,
    leaves_of,
    symbols_of,
)
from visup.tasks.learning.periods import Period, course_of
from visup.tasks.learning.places import PLACED_S, FinalPlace, Release
from visup.tasks.learning.precedence import Precedence, invariants
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.rests import Halt, Rest
from visup.tasks.learning.traces import BREAK_S, RunTrace, Symbol

STAGE_NAMES = {
    "converging": "approach",
    "coupled": "couple",
    "touching": "contact",
    "decoupled": "release",
    "diverging": "retreat",
    "moving_together": "carry",
    "apart": "part",
    KEEPING: "keep",
}
MARGIN = 3.0
"""Deadline of a stage as a multiple of its longest duration in a good run."""
LEAST_DEADLINE_S = 10.0
HELD_SHARE = 0.5
LONGEST_HOLD_S = 6.0
"""The last stage must hold for `HELD_SHARE` of its shortest duration, capped at `LONGEST_HOLD_S`."""
STAY = "stay"
"""Name of the stage in which those that have met stay as they are."""
RESTED_SHARE = 0.65
"""Who comes to rest must rest for this share of the shortest rest in a good run, capped likewise."""
COMPLETE = (*MEETINGS, "moving_together", "diverging")
"""Last events that are complete when they end or have lasted: no later event terminates them."""
LONGEST_RETREAT_S = 1.0
"""Cap of the shortest duration of a last stage in which two draw apart: recordings end soon after it."""


@dataclass
class Draft:
    """A task during induction.

    Attributes:
        name: Of the task.
        plan: Its course.
        times: Least and greatest number of iterations of each loop.
        runs: Good runs.
        rows: The events of each run.
        declared: Actors as the runs' own tasks declare them.
        forbidden: Symbols that must never occur.
        holding: Whether the last stage must hold for a while.
        keeping: Whether a stage of carrying fails when the two come apart.
        periods: The periodic loops.
        rests: Actors that must not be pushed.
        order: Contacts that must not come too early.
        places: How those that were brought together lie in the end.
        halt: Who comes to rest in the last stage.
        release: The release with which it ends.
    """

    name: str
    plan: Plan
    times: Times
    runs: Sequence[RunTrace]
    rows: Sequence[Sequence[CourseEvent]]
    declared: Mapping[str, Actor]
    forbidden: list[Symbol] = field(default_factory=list)
    holding: bool = True
    keeping: bool = True
    periods: dict[Loop, Period] = field(default_factory=dict)
    rests: tuple[Rest, ...] = ()
    order: tuple[Precedence, ...] = ()
    places: tuple[FinalPlace, ...] = ()
    halt: Halt | None = None
    release: Release | None = None

    def text(self) -> str:
        """The task file."""
        names = stage_names(self.plan)
        lines = [f"# {self.name}: learned from {runs_text(len(self.runs))}"]
        staying = self._staying()
        # A motion in passing may be left out where what lasts after it is asked for.
        last = ("?" if self.release is not None else "") + (f" <{STAY}>" if staying else "")
        course = _course(self.plan, names) + last
        lines.append(f"<{self.name}> ::= {course}")
        lines += [self._stage(o, name) for o, name in names.items()]
        lines += [staying] if staying else []
        lines += [str(self.declared[a]) for a in self.actors() if a in self.declared]
        lines += [
            f"never {action_text(s)}  # in no good run, and in a bad one" for s in self.forbidden
        ]
        seen = f"  # in {all_text(len(self.runs))}"
        lines += [line + seen for line in invariants(self.order, names)]
        early = [p for p in self.places if not (p.of_last or self.release)]
        lines += [p.invariant(names[p.stage], all_text(len(self.runs))) for p in early]
        lines += [rest.invariant(all_text(len(self.runs))) for rest in self.rests]
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
            least, most = self.times[item]
            body = " ".join(map(_part_text, item.body))
            said = f"{least} to {most} times in a row"
            return f"<{name}> ::= ({body}) at least {least} times at most {most} times  # {said}"
        spans = self._spans(occurrence)
        seen = f"in {len(spans)} of {runs_text(len(self.runs))}"
        if isinstance(item, Keep):
            return f"<{name}> ::= {action_text(item)} for {item.held_s:g} s  # {seen}"
        if not spans or (self._last(occurrence) and not self._settled()):
            held = self._held(occurrence) if self._last(occurrence) else 0.0
            course = self._asked(occurrence, f" for {held:g} s" if held else "")
            return f"<{name}> ::= {course}  # {seen}"
        took = f"{min(spans):.1f} to {max(spans):.1f} s"
        if self.release is not None and self._last(occurrence):
            return f"<{name}> ::= {action_text(item)}  # {seen}"
        course = self._asked(occurrence, f" within {deadline(spans)} s")
        return f"<{name}> ::= {course}  # {seen}, {took}"

    def _asked(self, occurrence: Occurrence, clause: str) -> str:
        """What a stage asks for, with a clause of time."""
        item = occurrence[0]
        already = self._from_the_start(occurrence) or self._meanwhile(occurrence)
        if isinstance(item, Carry):
            return f"({action_text(item)}){clause}{self._kept(item)}"
        if isinstance(item, Either):
            word = "already " if already else ""
            return " | ".join(f"{word}{action_text(part)}{clause}" for part in item.parts)
        action = action_text(item)
        if self.release is not None and item == self.release.parted:
            # Who has let go is apart, too, which may be seen before or after.
            return f"{action}{clause} | {action_text(('apart', item[1]))}{clause}"
        if isinstance(item, Joint) and (clause or already):
            action = f"({action})"
        return f"{'already ' if already else ''}{action}{clause}"

    def _settled(self) -> list[str]:
        """What holds in the end besides the last contact: how the two lie, and that one rests."""
        asked = (p for p in self.places if p.of_last or self.release is not None)
        found = [f"{p.quantity} > {p.least} %" for p in asked]
        return found + ([self.halt.fact] if self.halt is not None else [])

    def _staying(self) -> str:
        """A stage after the last contact, which may be in passing; empty if no more is known than that."""
        final, facts = final_of(self.plan), self._settled()
        if self.release is not None:
            # What shares an outline touches, though it may seem to pass while a third one moves there.
            placed = {p.contact for p in self.places}
            lasting = [s for s in self.release.kept if s not in placed]
            asked = " & ".join([*map(action_text, lasting), *facts])
            # It holds already where the retreat was seen.
            asked = f"({asked})" if " & " in asked else asked
            lasts = f"already {asked} for {PLACED_S:g} s"
            return f"<{STAY}> ::= {lasts}  # in {all_text(len(self.runs))}"
        if final is None or not facts:
            return ""
        held = self._held(final)
        clause = f" for {held:g} s" if held else ""
        asked = " & ".join([action_text(final[0]), *facts])
        return f"<{STAY}> ::= ({asked}){clause}  # in {all_text(len(self.runs))}"

    def _kept(self, item: Carry) -> str:
        """Carrying fails when the two come apart for longer than relations flicker."""
        apart = action_text(("apart", item.parts[0][1]))
        return f" fails when {apart} for {BREAK_S:g} s" if self.keeping else ""

    def _last(self, occurrence: Occurrence) -> bool:
        plan = self.plan
        while isinstance(plan, Series):
            plan = plan.parts[-1]
        return occurrence in leaves_of(plan)

    def _from_the_start(self, occurrence: Occurrence) -> bool:
        """Whether an event held from the start of some run, as far as was observed."""
        found = [event_of(row, occurrence) for row in self.rows]
        return any(e is not None and not e.happening.begun for e in found)

    def _meanwhile(self, occurrence: Occurrence) -> bool:
        """Whether a lasting meeting is one of several in any order, so that it may begin during others."""
        if occurrence not in _single_parts(self.plan):
            return False
        found = [event_of(row, occurrence) for row in self.rows]
        return all(e is not None and e.lasts and e.symbol[0] in MEETINGS for e in found)

    def _held(self, occurrence: Occurrence) -> float:
        """How long the last event must hold, seconds; 0 if it does not last to the end."""
        if not self.holding:
            return 0.0
        found = [event_of(row, occurrence) for row in self.rows]
        # A meeting is complete when it ends or has lasted: no later event terminates it.
        if not all(e is not None and (e.lasts or e.symbol[0] in COMPLETE) for e in found):
            return 0.0
        shortest = min(e.happening.end - e.happening.begin for e in found if e is not None)
        if self.halt is not None:
            return floor(2 * RESTED_SHARE * min(self.halt.rested_s, LONGEST_HOLD_S)) / 2
        drawing_back = any(e is not None and e.symbol[0] == "diverging" for e in found)
        most = LONGEST_RETREAT_S if drawing_back else LONGEST_HOLD_S
        return max(0.0, floor(2 * HELD_SHARE * min(shortest, most)) / 2)

    def _spans(self, occurrence: Occurrence) -> list[float]:
        """Greatest duration of a stage in each run: from the event before it to the event after it.

        A stage that completes by itself (a contact) lets the next one begin at once, so the time of the
        next counts from there.
        """
        course = leaves_of(self.plan)
        found = []
        for run, row in zip(self.runs, self.rows, strict=True):
            begins = {o: t for o in course if (t := begin_of(row, o)) is not None}
            mine = begins.pop(occurrence, None)
            if mine is None:
                continue
            earlier = [t for t in begins.values() if t < mine]
            later = [t for t in begins.values() if t > mine]
            found.append(min(later, default=mine) - max(earlier, default=run.begin))
        return found


def _single_parts(plan: Plan) -> list[Occurrence]:
    """The stages that are by themselves one of several in any order."""
    if isinstance(plan, Series):
        return [o for p in plan.parts for o in _single_parts(p)]
    if isinstance(plan, Free):
        return [p for p in plan.parts if not isinstance(p, Series | Free)]
    return []


def stage_names(plan: Plan) -> dict[Occurrence, str]:
    """A unique name for each stage: its action, then its actors, then a number."""
    occurrences = leaves_of(plan)
    plain = [_plain(o[0]) for o in occurrences]
    found: dict[Occurrence, str] = {}
    for occurrence, word in zip(occurrences, plain, strict=True):
        name = word if plain.count(word) == 1 else f"{word}_{_who(occurrence[0])}"
        number = 2
        tried = name
        while tried in found.values():
            tried, number = f"{name}_{number}", number + 1
        found[occurrence] = tried
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
    return None if found is None else found.happening.begin


def deadline(spans: Sequence[float]) -> int:
    """A deadline with margin, in whole seconds; from 20 s on in multiples of 5."""
    raw = max(LEAST_DEADLINE_S, MARGIN * max(spans, default=inf))
    return ceil(raw) if raw < 20 else 5 * ceil(raw / 5)


def _course(plan: Plan, names: Mapping[Occurrence, str]) -> str:
    if isinstance(plan, Series):
        return " ".join(_course(p, names) for p in plan.parts)
    if isinstance(plan, Free):
        return f"any order ({', '.join(_course(p, names) for p in plan.parts)})"
    return f"<{names[plan]}>"


def _part_text(item: Item) -> str:
    """A part of a loop as text, a group in brackets."""
    text = action_text(item)
    return text if isinstance(item, tuple | Loop) else f"({text})"


def _plain(item: Item) -> str:
    if isinstance(item, Loop):
        return "repeat"
    if isinstance(item, Carry):
        return STAGE_NAMES["moving_together"]
    words = [STAGE_NAMES.get(action, action) for action, _ in symbols_of(item)]
    return "_and_".join(dict.fromkeys(words))


def _who(item: Item) -> str:
    return "_".join(dict.fromkeys(a for _, actors in symbols_of(item) for a in actors))


def all_text(count: int) -> str:
    """All of some runs: `3 of 3 runs`."""
    return f"{count} of {runs_text(count)}"


def runs_text(count: int) -> str:
    """A number of runs: `3 runs`."""
    return f"{count} {'run' if count == 1 else 'runs'}"
