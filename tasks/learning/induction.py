"""Induction of a task file from good runs, each line with its evidence as a comment.

Events of nearly all runs form the course; those of some runs only are reported and dropped. The file is
validated on every run that it was learned from, and a stage that would refuse one is removed. Bad
runs add invariants against events that never occurred in a good one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import ceil, floor, inf

from visup.agent import Status, Verdict
from visup.agent.model.errors import TaskError
from visup.tasks.checks.load import parse_task
from visup.tasks.grammar.nodes import Actor
from visup.tasks.learning.alignment import aligned
from visup.tasks.learning.bodies import as_one_body
from visup.tasks.learning.judging import JudgedRun, judged
from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import (
    Either,
    Free,
    Item,
    Joint,
    Loop,
    Occurrence,
    Plan,
    Series,
    Times,
    action_text,
    leaves_of,
    plan_of,
    shared,
    symbols_of,
    with_loops,
    without,
)
from visup.tasks.learning.periods import Period, course_of, periods_of
from visup.tasks.learning.precedence import Precedence, invariants, precedences
from visup.tasks.learning.relevance import AT_ONCE_S, CourseEvent, joined, relevant
from visup.tasks.learning.rests import Rest, rests_of
from visup.tasks.learning.traces import RunTrace, Symbol

STAGE_NAMES = {
    "converging": "approach",
    "coupled": "couple",
    "touching": "contact",
    "decoupled": "release",
    "diverging": "retreat",
    "apart": "part",
}
MARGIN = 3.0
"""Deadline of a stage as a multiple of its longest duration in a good run."""
LEAST_DEADLINE_S = 10.0
HELD_SHARE = 0.5
LONGEST_HOLD_S = 6.0
"""The last stage must hold for `HELD_SHARE` of its shortest duration, capped at `LONGEST_HOLD_S`."""
SHARE = 0.8
"""Least share of good runs in which an event occurs for it to be part of the course."""
FORBIDDEN = ("touching", "coupled")
"""Actions that are forbidden when they occur in bad runs only."""


@dataclass(frozen=True)
class LearnedTask:
    """A learned task.

    Attributes:
        text: The task file.
        good: Its verdict on each good run.
        bad: Its verdict on each bad run.
        dropped: Events of the runs that are not in the file, with the reason.
    """

    text: str
    good: Mapping[str, Verdict]
    bad: Mapping[str, Verdict]
    dropped: tuple[str, ...]


@dataclass
class _Draft:
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
        periods: The periodic loops.
        rests: Actors that must not be pushed.
        order: Contacts that must not come too early.
    """

    name: str
    plan: Plan
    times: Times
    runs: Sequence[RunTrace]
    rows: Sequence[Sequence[CourseEvent]]
    declared: Mapping[str, Actor]
    forbidden: list[Symbol] = field(default_factory=list)
    holding: bool = True
    periods: dict[Loop, Period] = field(default_factory=dict)
    rests: tuple[Rest, ...] = ()
    order: tuple[Precedence, ...] = ()

    def text(self) -> str:
        """The task file."""
        names = stage_names(self.plan)
        lines = [f"# {self.name}: learned from {_runs(len(self.runs))}"]
        lines.append(f"<{self.name}> ::= {_course(self.plan, names)}")
        lines += [self._stage(o, name) for o, name in names.items()]
        lines += [str(self.declared[a]) for a in self.actors() if a in self.declared]
        lines += [
            f"never {action_text(s)}  # in no good run, and in a bad one" for s in self.forbidden
        ]
        seen = f"  # in {_all(len(self.runs))}"
        lines += [line + seen for line in invariants(self.order, names)]
        lines += [rest.invariant(_all(len(self.runs))) for rest in self.rests]
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
            body = " ".join(action_text(s) for i in item.body for s in symbols_of(i))
            said = f"{least} to {most} times in a row"
            return f"<{name}> ::= ({body}) at least {least} times at most {most} times  # {said}"
        spans = self._spans(occurrence)
        seen = f"in {len(spans)} of {_runs(len(self.runs))}"
        if not spans or self._last(occurrence):
            held = self._held(occurrence) if self._last(occurrence) else 0.0
            course = self._asked(occurrence, f" for {held:g} s" if held else "")
            return f"<{name}> ::= {course}  # {seen}"
        took = f"{min(spans):.1f} to {max(spans):.1f} s"
        course = self._asked(occurrence, f" within {deadline(spans)} s")
        return f"<{name}> ::= {course}  # {seen}, {took}"

    def _asked(self, occurrence: Occurrence, clause: str) -> str:
        """What a stage asks for, with a clause of time."""
        item, already = occurrence[0], self._from_the_start(occurrence)
        if isinstance(item, Either):
            word = "already " if already else ""
            return " | ".join(f"{word}{action_text(part)}{clause}" for part in item.parts)
        action = action_text(item)
        if isinstance(item, Joint) and (clause or already):
            action = f"({action})"
        return f"{'already ' if already else ''}{action}{clause}"

    def _last(self, occurrence: Occurrence) -> bool:
        plan = self.plan
        while isinstance(plan, Series):
            plan = plan.parts[-1]
        return occurrence in leaves_of(plan)

    def _from_the_start(self, occurrence: Occurrence) -> bool:
        """Whether an event held from the start of some run, as far as was observed."""
        found = [event_of(row, occurrence) for row in self.rows]
        return any(e is not None and not e.happening.begun for e in found)

    def _held(self, occurrence: Occurrence) -> float:
        """How long the last event must hold, seconds; 0 if it does not last to the end."""
        if not self.holding:
            return 0.0
        found = [event_of(row, occurrence) for row in self.rows]
        # A meeting is complete when it ends or has lasted: no later event terminates it.
        if not all(e is not None and (e.lasts or e.symbol[0] in MEETINGS) for e in found):
            return 0.0
        shortest = min(e.happening.end - e.happening.begin for e in found if e is not None)
        return max(0.0, floor(2 * HELD_SHARE * min(shortest, LONGEST_HOLD_S)) / 2)

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


def learn_task(
    name: str,
    good: Sequence[RunTrace],
    bad: Sequence[RunTrace] = (),
    declared: Mapping[str, Actor] | None = None,
) -> LearnedTask:
    """Propose a task file.

    Args:
        name: Of the task.
        good: Runs that succeeded.
        bad: Runs that failed.
        declared: Actors as the runs' own tasks declare them, by name.

    Returns:
        The file and its verdicts on the runs.

    Raises:
        TaskError: The good runs have no event in common.
    """
    rows = joined(as_one_body(relevant(good), good))
    folded, times = with_loops([tuple(e.item for e in row) for row in rows])
    if not times:  # without loops, surplus repeats in some runs are noise
        rows = aligned(rows)
        folded = [tuple(e.item for e in row) for row in rows]
    core = shared(folded, SHARE)
    if not core:
        raise TaskError(
            "the runs have nothing in common that a task could ask for",
            expected="runs in which named objects approach, touch or couple",
            hint="name objects by --models, --teach or a task with actors, and record again",
        )
    seen = {o for w in folded for o in shared([w], 1.0)}
    dropped = [f"{_text(o)}: in some runs only" for o in sorted(seen - set(core), key=repr)]
    plan = plan_of(folded, core, partial(_at_once, rows))
    periods = periods_of(times, rows)
    draft = _Draft(name, plan, times, good, rows, declared or {}, periods=periods)
    results = _validated(draft, dropped)
    _require(draft, results)
    bad_verdicts = {r.name: _judge(draft, r) for r in bad}
    for run in bad:
        if bad_verdicts[run.name] is Verdict.SUCCEEDED:
            _forbid(draft, run)
    if draft.forbidden:
        bad_verdicts = {r.name: _judge(draft, r) for r in bad}
        results = {r.name: _judge(draft, r) for r in good}
    return LearnedTask(draft.text(), results, bad_verdicts, tuple(dropped))


def _validated(draft: _Draft, dropped: list[str]) -> dict[str, Verdict]:
    """Relax the draft until it accepts all good runs, as far as possible; returns their verdicts."""
    while True:
        task = parse_task(draft.text())
        found = {r.name: judged(task, r.minds) for r in draft.runs if r.minds}
        refused = [j for j in found.values() if j.verdict is not Verdict.SUCCEEDED]
        if refused and draft.periods:
            draft.periods = {}
            continue
        if refused and draft.holding:
            draft.holding = False
            continue
        blamed = _blamed(draft, refused[0]) if refused else None
        if blamed is None:
            return {name: j.verdict for name, j in found.items()}
        plan = without(draft.plan, blamed)
        if plan is None:
            return {name: j.verdict for name, j in found.items()}
        dropped.append(f"{_text(blamed)}: a good run would be refused by it")
        draft.plan = plan


def _require(draft: _Draft, results: Mapping[str, Verdict]) -> None:
    """Require what held in all good runs, unless that changes a verdict of one: order, and who rests."""
    draft.order = tuple(precedences(draft.plan, draft.rows, draft.runs))
    if draft.order and _verdicts(draft) != dict(results):
        draft.order = ()
    draft.rests = tuple(rests_of(draft.runs, draft.actors()))
    if draft.rests and _verdicts(draft) != dict(results):
        draft.rests = ()


def _verdicts(draft: _Draft) -> dict[str, Verdict]:
    return {r.name: _judge(draft, r) for r in draft.runs if r.minds}


def _blamed(draft: _Draft, run: JudgedRun) -> Occurrence | None:
    """The stage that refuses a run: the first one that is not done."""
    for occurrence, name in stage_names(draft.plan).items():
        if run.statuses.get(name) is not Status.DONE:
            return occurrence
    return None


def _judge(draft: _Draft, run: RunTrace) -> Verdict:
    return judged(parse_task(draft.text()), run.minds).verdict


def _forbid(draft: _Draft, run: RunTrace) -> None:
    """Forbid events that occurred in a bad run and in no good one."""
    allowed = {h.symbol for r in draft.runs for h in r.happenings}
    actors = {a for r in draft.runs for h in r.happenings for a in h.symbol[1]}
    for happening in run.happenings:
        action, who = happening.symbol
        new = happening.symbol not in allowed and happening.symbol not in draft.forbidden
        if new and action in FORBIDDEN and actors.intersection(who):
            draft.forbidden.append(happening.symbol)


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


def _at_once(rows: Sequence[Sequence[CourseEvent]], a: Occurrence, b: Occurrence) -> bool:
    """Whether two occurrences are so close in some run that their order may be random."""
    events = [(event_of(row, a), event_of(row, b)) for row in rows]
    pairs = [(x, y) for x, y in events if x is not None and y is not None]
    if any(_pairs(x.item) & _pairs(y.item) for x, y in pairs):
        return False
    return any(abs(x.at - y.at) < AT_ONCE_S for x, y in pairs)


def _pairs(item: Item) -> set[tuple[str, ...]]:
    return {actors for _, actors in symbols_of(item)}


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


def _plain(item: Item) -> str:
    if isinstance(item, Loop):
        return "repeat"
    words = [STAGE_NAMES.get(action, action) for action, _ in symbols_of(item)]
    return "_and_".join(dict.fromkeys(words))


def _who(item: Item) -> str:
    return "_".join(dict.fromkeys(a for _, actors in symbols_of(item) for a in actors))


def _text(occurrence: Occurrence) -> str:
    return action_text(occurrence[0])


def _all(count: int) -> str:
    return f"{count} of {_runs(count)}"


def _runs(count: int) -> str:
    return f"{count} {'run' if count == 1 else 'runs'}"
