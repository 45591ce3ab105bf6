"""From good runs to a task file that accepts them, each line with its evidence.

What is in nearly all runs is the course; what is in some only is told and left out. The file is tried on
every run that it was learned from: a stage by which one would be refused is taken out again. Bad
runs add what never happened in a good one.
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
from visup.tasks.learning.judging import JudgedRun, judged
from visup.tasks.learning.meetings import MEETINGS
from visup.tasks.learning.order import (
    Free,
    Item,
    Joint,
    Loop,
    Occurrence,
    Plan,
    Series,
    Times,
    leaves_of,
    plan_of,
    shared,
    with_loops,
    without,
)
from visup.tasks.learning.periods import Period, course_of, periods_of
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
"""A stage may take so many times as long as it ever took in a good run."""
LEAST_DEADLINE_S = 10.0
HELD_SHARE = 0.5
LONGEST_HOLD_S = 6.0
"""What a run ends with must hold for that share of the least time for which it did, or of this."""
SHARE = 0.8
"""What is in so many of the good runs is part of the course."""
FORBIDDEN = ("touching", "coupled")
"""Of what happened in bad runs alone, what is forbidden."""


@dataclass(frozen=True)
class LearnedTask:
    """What was learned.

    Attributes:
        text: The task file.
        good: Verdict of each good run by it.
        bad: Verdict of each bad run.
        dropped: What was in the runs and is not in the file, with the reason.
    """

    text: str
    good: Mapping[str, Verdict]
    bad: Mapping[str, Verdict]
    dropped: tuple[str, ...]


@dataclass
class _Draft:
    """A task on its way.

    Attributes:
        name: Of the task.
        plan: Its course.
        times: Of each loop.
        runs: Good runs.
        rows: What each is made of.
        declared: Actors as the runs' own tasks declare them.
        forbidden: Symbols that must never be.
        holding: Whether what runs end with must hold for a while.
        periods: The loops that keep a rhythm.
        rests: Who must not be pushed about.
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

    def text(self) -> str:
        """The task file."""
        names = stage_names(self.plan)
        lines = [f"# {self.name}: learned from {_runs(len(self.runs))}"]
        lines.append(f"<{self.name}> ::= {_course(self.plan, names)}")
        lines += [self._stage(o, name) for o, name in names.items()]
        lines += [str(self.declared[a]) for a in self.actors() if a in self.declared]
        lines += [f"never {_action(s)}  # in no good run, and in a bad one" for s in self.forbidden]
        lines += [rest.invariant(_all(len(self.runs))) for rest in self.rests]
        return "\n".join(lines) + "\n"

    def actors(self) -> list[str]:
        """Who plays in it."""
        symbols = [s for o in leaves_of(self.plan) for s in _symbols(o[0])]
        return sorted({a for _, actors in (*symbols, *self.forbidden) for a in actors})

    def _stage(self, occurrence: Occurrence, name: str) -> str:
        item = occurrence[0]
        if isinstance(item, Loop) and item in self.periods:
            return f"<{name}> ::= {course_of(item, self.periods[item])}"
        if isinstance(item, Loop):
            least, most = self.times[item]
            body = " ".join(_action(s) for i in item.body for s in _symbols(i))
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
        action, already = _action(occurrence[0]), self._from_the_start(occurrence)
        if isinstance(occurrence[0], Joint) and (clause or already):
            action = f"({action})"
        return f"{'already ' if already else ''}{action}{clause}"

    def _last(self, occurrence: Occurrence) -> bool:
        plan = self.plan
        while isinstance(plan, Series):
            plan = plan.parts[-1]
        return occurrence in leaves_of(plan)

    def _from_the_start(self, occurrence: Occurrence) -> bool:
        """Whether what happens was so from the start of some run, as far as one can see."""
        found = [event_of(row, occurrence) for row in self.rows]
        return any(e is not None and not e.happening.begun for e in found)

    def _held(self, occurrence: Occurrence) -> float:
        """How long what a run ends with must hold, seconds; 0 where it does not last to the end."""
        if not self.holding:
            return 0.0
        found = [event_of(row, occurrence) for row in self.rows]
        # A meeting is over when it ends, or has lasted: nothing follows by which it would end.
        if not all(e is not None and (e.lasts or e.symbol[0] in MEETINGS) for e in found):
            return 0.0
        shortest = min(e.happening.end - e.happening.begin for e in found if e is not None)
        return max(0.0, floor(2 * HELD_SHARE * min(shortest, LONGEST_HOLD_S)) / 2)

    def _spans(self, occurrence: Occurrence) -> list[float]:
        """How long a stage took at most in each run: from what came before it to what came after.

        What is over by itself (a contact) lets the next stage begin at once, so that its time counts
        from there.
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
        good: Runs in which it went well.
        bad: Runs in which it did not.
        declared: Actors as the runs' own tasks declare them, by name.

    Returns:
        The file and how it judges the runs.

    Raises:
        TaskError: Nothing happens in the good runs that they have in common.
    """
    rows = joined(relevant(good))
    folded, times = with_loops([tuple(e.item for e in row) for row in rows])
    if not times:  # what is there more often in some runs than in others is noise then
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
    dropped = [f"{_said(o)}: in some runs only" for o in sorted(seen - set(core), key=repr)]
    plan = plan_of(folded, core, partial(_at_once, rows))
    periods = periods_of(times, rows)
    draft = _Draft(name, plan, times, good, rows, declared or {}, periods=periods)
    results = _tried(draft, dropped)
    _ask_for_rests(draft, results)
    told = {r.name: _judge(draft, r) for r in bad}
    for run in bad:
        if told[run.name] is Verdict.SUCCEEDED:
            _forbid(draft, run)
    if draft.forbidden:
        told = {r.name: _judge(draft, r) for r in bad}
        results = {r.name: _judge(draft, r) for r in good}
    return LearnedTask(draft.text(), results, told, tuple(dropped))


def _tried(draft: _Draft, dropped: list[str]) -> dict[str, Verdict]:
    """The verdicts of the good runs, after all by which one is refused has been taken out."""
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
        dropped.append(f"{_said(blamed)}: a good run would be refused by it")
        draft.plan = plan


def _ask_for_rests(draft: _Draft, results: Mapping[str, Verdict]) -> None:
    """Who rests in all good runs must, unless one of them would be refused by it."""
    draft.rests = tuple(rests_of(draft.runs, draft.actors()))
    if {r.name: _judge(draft, r) for r in draft.runs if r.minds} != dict(results):
        draft.rests = ()


def _blamed(draft: _Draft, run: JudgedRun) -> Occurrence | None:
    """The stage by which a run is refused: the first one that is not done."""
    for occurrence, name in stage_names(draft.plan).items():
        if run.statuses.get(name) is not Status.DONE:
            return occurrence
    return None


def _judge(draft: _Draft, run: RunTrace) -> Verdict:
    return judged(parse_task(draft.text()), run.minds).verdict


def _forbid(draft: _Draft, run: RunTrace) -> None:
    """What happened in a bad run and in no good one must never be."""
    fine = {h.symbol for r in draft.runs for h in r.happenings}
    actors = {a for r in draft.runs for h in r.happenings for a in h.symbol[1]}
    for happening in run.happenings:
        action, who = happening.symbol
        new = happening.symbol not in fine and happening.symbol not in draft.forbidden
        if new and action in FORBIDDEN and actors.intersection(who):
            draft.forbidden.append(happening.symbol)


def stage_names(plan: Plan) -> dict[Occurrence, str]:
    """A name for each stage: by what happens, then by who takes part, then by number."""
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
    """Something that happened for the n-th time in a run, or None."""
    item, number = occurrence
    first = item
    while isinstance(first, Loop):
        first = first.body[0]
    found = [e for e in row if e.item == first]
    return found[number] if number < len(found) else None


def begin_of(row: Sequence[CourseEvent], occurrence: Occurrence) -> float | None:
    """When something happened in a run for the n-th time, or None."""
    found = event_of(row, occurrence)
    return None if found is None else found.happening.begin


def _at_once(rows: Sequence[Sequence[CourseEvent]], a: Occurrence, b: Occurrence) -> bool:
    """Whether two things come so close in some run that their order may be chance."""
    both = [(event_of(row, a), event_of(row, b)) for row in rows]
    pairs = [(x, y) for x, y in both if x is not None and y is not None]
    if any(_pairs(x.item) & _pairs(y.item) for x, y in pairs):
        return False
    return any(abs(x.at - y.at) < AT_ONCE_S for x, y in pairs)


def _pairs(item: Item) -> set[tuple[str, ...]]:
    return {actors for _, actors in _symbols(item)}


def deadline(spans: Sequence[float]) -> int:
    """A time with a margin, in whole seconds: of larger ones multiples of 5."""
    raw = max(LEAST_DEADLINE_S, MARGIN * max(spans, default=inf))
    return ceil(raw) if raw < 20 else 5 * ceil(raw / 5)


def _course(plan: Plan, names: Mapping[Occurrence, str]) -> str:
    if isinstance(plan, Series):
        return " ".join(_course(p, names) for p in plan.parts)
    if isinstance(plan, Free):
        return f"any order ({', '.join(_course(p, names) for p in plan.parts)})"
    return f"<{names[plan]}>"


def _symbols(item: Item) -> list[Symbol]:
    if isinstance(item, Joint):
        return list(item.parts)
    return [s for i in item.body for s in _symbols(i)] if isinstance(item, Loop) else [item]


def _action(symbol: Item) -> str:
    if isinstance(symbol, Loop):
        return " ".join(map(_action, symbol.body))
    if isinstance(symbol, Joint):
        return " & ".join(map(_action, symbol.parts))
    action, actors = symbol
    return f"{action}({', '.join(actors)})"


def _plain(item: Item) -> str:
    if isinstance(item, Loop):
        return "repeat"
    words = [STAGE_NAMES.get(action, action) for action, _ in _symbols(item)]
    return "_and_".join(dict.fromkeys(words))


def _who(item: Item) -> str:
    return "_".join(dict.fromkeys(a for _, actors in _symbols(item) for a in actors))


def _said(occurrence: Occurrence) -> str:
    return _action(occurrence[0])


def _all(count: int) -> str:
    return f"{count} of {_runs(count)}"


def _runs(count: int) -> str:
    return f"{count} {'run' if count == 1 else 'runs'}"
