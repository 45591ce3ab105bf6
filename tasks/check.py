"""What a tree must satisfy beyond its syntax: names, actors, courses that end, clauses that agree.

Each check tells a fault where it stands and none that merely follows from another.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import SequenceMatcher
from functools import cached_property

from visup.tasks.actions import Meaning, contradict
from visup.tasks.faults import Source, TaskFault, closest, did_you_mean
from visup.tasks.language import Grammar
from visup.tasks.mistakes import WORDS
from visup.tasks.syntax import Parsed
from visup.tasks.tree import (
    SECONDS_PER_UNIT,
    Action,
    Actors,
    Course,
    Deadline,
    Duration,
    Hold,
    Name,
    Reference,
    Repeated,
    Span,
    Stage,
    Timed,
    Together,
    walk,
)

UNITS = {
    "sec": "s", "secs": "s", "second": "s", "seconds": "s", "m": "min", "mins": "min",
    "minute": "min", "minutes": "min", "hr": "h", "hrs": "h", "hour": "h", "hours": "h",
    "msec": "ms", "msecs": "ms", "millisecond": "ms", "milliseconds": "ms",
}  # fmt: skip
ALIKE = 0.85  # two names that are so alike are taken to be meant as one


def check(parsed: Parsed, source: Source, actions: Mapping[str, Meaning]) -> list[TaskFault]:
    """All mistakes of meaning in what could be read of a file.

    Args:
        parsed: The tree, and what is known of the statements that did not parse.
        source: For places.
        actions: The actions that a task may ask for.

    Returns:
        Faults in no particular order.
    """
    if not parsed.task.stages:
        return []
    return list(_Check(parsed, source, actions).faults())


@dataclass(frozen=True)
class _Check:
    parsed: Parsed
    source: Source
    actions: Mapping[str, Meaning]

    @cached_property
    def grammar(self) -> Grammar:
        return Grammar(self.parsed.task)

    @cached_property
    def courses(self) -> list[tuple[Stage, Course]]:
        """Every course of every stage, outermost first, with its stage."""
        task = self.parsed.task
        bodies = [(s, s.body) for s in task.stages if not isinstance(s.body, Actors)]
        return [(s, c) for s, body in bodies for c in walk(body)]

    @cached_property
    def asked(self) -> list[tuple[str, tuple[Name, ...], Span]]:
        """Every action that the file names, with its actors: (action, actors, place)."""
        task = self.parsed.task
        asked = [(c.name, c.actors, c.span) for _, c in self.courses if isinstance(c, Action)]
        asked += [
            (s.name, s.body.names, s.span)
            for s in task.stages
            if isinstance(s.body, Actors) and not self.misread(s)
        ]
        asked += [(i.action.name, i.action.actors, i.action.span) for i in task.invariants]
        return asked

    def faults(self) -> Iterator[TaskFault]:
        yield from self.plain_lists()
        yield from self.reserved()
        yield from self.unknown_actions()
        yield from self.actors_of_actions()
        yield from self.references()
        yield from self.twice()
        if not self.parsed.faults:
            yield from self.unreached()
            yield from self.slips()
            yield from self.idle_actors()
        yield from self.endless()
        yield from self.durations()
        yield from self.clauses()
        yield from self.together()
        yield from self.invariants()
        yield from self.repetitions()

    def fault(
        self,
        code: str,
        what: str,
        span: Span,
        expected: str | None = None,
        hint: str | None = None,
    ) -> TaskFault:
        return TaskFault(code, what, self.source.at(span), expected=expected, hint=hint)

    def misread(self, stage: Stage) -> str:
        """What a plain list of names was meant to be when it is no action, or empty."""
        if not isinstance(stage.body, Actors) or stage.name in self.actions:
            return ""
        names = [str(n) for n in stage.body.names]
        if names[0] in self.actions:
            return "action"
        defined = {s.name for s in self.parsed.task.stages} - {stage.name}
        return "stages" if all(n in defined for n in names) else ""

    def plain_lists(self) -> Iterator[TaskFault]:
        for stage in self.parsed.task.stages:
            if not isinstance(stage.body, Actors):
                continue
            names = [str(n) for n in stage.body.names]
            match self.misread(stage):
                case "action":
                    meant = f"`{names[0]}({', '.join(names[1:]) or '...'})`"
                    what = f"the actors of `{names[0]}` stand without brackets"
                    yield self.fault("E219", what, stage.body.span, meant)
                case "stages":
                    meant = f"`{' '.join(f'<{n}>' for n in names)}`"
                    what = "stages are referred to without angle brackets"
                    yield self.fault("E220", what, stage.body.span, meant)

    def reserved(self) -> Iterator[TaskFault]:
        named = [a for _, actors, _ in self.asked for a in actors]
        named += [Name(a.name, a.span) for a in self.parsed.task.actors]
        for name in named:
            if str(name) in WORDS:
                what = f"`{name}` is a word of the language"
                yield self.fault("E123", what, name.span, "another name")

    def unknown_actions(self) -> Iterator[TaskFault]:
        told = set()
        for name, _, span in self.asked:
            if name in self.actions or name in told:
                continue
            told.add(name)
            near = closest(name, self.actions)
            shown = f"an action: {', '.join(sorted(self.actions))}"
            width = Span(span.line, span.column, span.line, span.column + len(name))
            at = span if self.is_head(span) else width
            hint = f"did you mean `{near}`?" if near else None
            what = f"unknown action `{name}`"
            if self.is_head(span):
                what = f"`<{name}>` is given actors, but `{name}` is no action"
            yield self.fault("E201", what, at, shown, hint)

    def is_head(self, span: Span) -> bool:
        return any(s.span is span for s in self.parsed.task.stages)

    def actors_of_actions(self) -> Iterator[TaskFault]:
        for name, actors, span in self.asked:
            meaning = self.actions.get(name)
            if meaning is None:
                continue
            if len(actors) != meaning.arity:
                what = f"`{name}` is given {_count(len(actors), 'actor')}"
                yield self.fault("E205", what, span, _count(meaning.arity, "actor"))
            elif len({str(a) for a in actors}) < len(actors):
                what = f"`{name}` between `{actors[0]}` and itself"
                yield self.fault("E211", what, span, "different actors")

    @cached_property
    def undefined(self) -> dict[str, Reference]:
        """The first reference to each stage that is not defined."""
        known = {s.name for s in self.parsed.task.stages} | self.parsed.defined
        found: dict[str, Reference] = {}
        references = [c for _, c in self.courses if isinstance(c, Reference)]
        references += [i.during for i in self.parsed.task.invariants if i.during]
        for r in references:
            if r.stage not in known:
                found.setdefault(r.stage, r)
        return found

    def references(self) -> Iterator[TaskFault]:
        defined = [s.name for s in self.parsed.task.stages]
        heads = self.headless()
        for name, reference in self.undefined.items():
            if name in heads:
                what = f"`::=` is missing after `<{name}>`"
                yield self.fault("E102", what, heads[name].span, f"`<{name}> ::= ...`")
                continue
            expected = f"a rule `<{name}> ::= ...`"
            if name in self.actions:
                expected = f"a rule `<{name}> ::= arm satellite`, or `{name}(arm, satellite)`"
            hint = did_you_mean(name, defined, "`<{}>`")
            what = f"stage `<{name}>` is not defined"
            yield self.fault("E202", what, reference.span, expected, hint)

    def headless(self) -> dict[str, Reference]:
        """Undefined stages at the beginning of a line, where a rule without `::=` would stand."""
        found: dict[str, Reference] = {}
        for _, c in self.courses:
            if isinstance(c, Reference) and c.stage in self.undefined:
                line = self.source.at(c.span).text
                rest = line[c.span.end_column - 1 :].strip()
                if not line[: c.span.column - 1].strip() and rest:
                    found.setdefault(c.stage, c)
        return found

    def twice(self) -> Iterator[TaskFault]:
        first: dict[str, Span] = {}
        for stage in self.parsed.task.stages:
            if stage.name in first:
                what = f"stage `<{stage.name}>` is defined twice"
                hint = f"it is also defined in line {first[stage.name].line}; join both with `|`"
                yield self.fault("E203", what, stage.span, "one rule for each stage", hint)
            first.setdefault(stage.name, stage.span)
        declared: dict[str, Span] = {}
        for actor in self.parsed.task.actors:
            if actor.name in declared:
                what = f"actor `{actor.name}` is declared twice"
                hint = f"it is also declared in line {declared[actor.name].line}"
                yield self.fault("E212", what, actor.span, "`or` between its models", hint)
            declared.setdefault(actor.name, actor.span)

    def unreached(self) -> Iterator[TaskFault]:
        if self.headless():
            return
        missing = {closest(u, self.grammar.stages) for u in self.undefined}
        misread = {
            str(n)
            for s in self.parsed.task.stages
            if isinstance(s.body, Actors) and self.misread(s)
            for n in s.body.names
        }
        for stage in self.grammar.unreached():
            if stage.name not in missing | misread:
                what = f"task `{self.parsed.task.name}` never comes to stage `<{stage.name}>`"
                hint = "refer to it from another stage, or take it out; the first rule is the task"
                yield self.fault("E204", what, stage.span, hint=hint)

    def slips(self) -> Iterator[TaskFault]:
        """Actors that are named once and look like another that is declared or named more often."""
        counts = Counter(str(a) for _, actors, _ in self.asked for a in actors)
        declared = {a.name for a in self.parsed.task.actors}
        for _, actors, _ in self.asked:
            for actor in actors:
                name = str(actor)
                if name in declared or counts[name] > 1:
                    continue
                for other in (*declared, *counts):
                    if (other in declared or counts[other] > 1) and _slip(name, other):
                        what = f"actor `{name}` is named only here"
                        hint = f"did you mean `{other}`?"
                        yield self.fault("E214", what, actor.span, hint=hint)
                        break

    def idle_actors(self) -> Iterator[TaskFault]:
        named = {str(a) for _, actors, _ in self.asked for a in actors}
        for actor in self.parsed.task.actors:
            if actor.name not in named and not any(_slip(n, actor.name) for n in named):
                what = f"actor `{actor.name}` is declared but takes no part"
                hint = did_you_mean(actor.name, named)
                yield self.fault("E213", what, actor.span, "an action with this actor", hint)

    def endless(self) -> Iterator[TaskFault]:
        begins = self.grammar.begin_with_themselves()
        for stage in begins:
            what = f"stage `<{stage.name}>` begins with itself and so never begins"
            hint = f"let something come first, such as `<try> | <try> <{stage.name}>`"
            yield self.fault("E206", what, stage.span, "an action before it comes again", hint)
        if begins or self.undefined or self.parsed.faults:
            return
        for stage in self.grammar.never_end():
            what = f"stage `<{stage.name}>` can never end"
            hint = f"offer a way out, such as `( ... <{stage.name}> )?` or `| ...`"
            yield self.fault("E207", what, stage.span, "a course without the stage itself", hint)

    def durations(self) -> Iterator[TaskFault]:
        for _, course in self.courses:
            if not isinstance(course, Timed):
                continue
            for duration in (c.duration for c in course.clauses):
                yield from self.duration(duration)

    def duration(self, duration: Duration) -> Iterator[TaskFault]:
        if duration.unit not in SECONDS_PER_UNIT:
            meant = UNITS.get(duration.unit.casefold())
            hint = f"did you mean `{meant}`?" if meant else None
            what = f"`{duration.unit}` is not a unit of time"
            yield self.fault("E218", what, duration.span, "`ms`, `s`, `min` or `h`", hint)
        elif duration.amount <= 0:
            yield self.fault("E217", f"`{duration}` is no time at all", duration.span)

    def clauses(self) -> Iterator[TaskFault]:
        for _, course in self.courses:
            if not isinstance(course, Timed):
                continue
            holds = [c for c in course.clauses if isinstance(c, Hold)]
            deadlines = [c for c in course.clauses if isinstance(c, Deadline)]
            for word, clauses in (("for", holds), ("within", deadlines)):
                if len(clauses) > 1:
                    span = clauses[1].span
                    yield self.fault("E208", f"`{word}` is said twice", span, f"one `{word}`")
            least = self.grammar.least_time(course)
            for deadline in deadlines[:1]:
                if float("inf") > least > deadline.duration.seconds > 0:
                    what = f"what takes at least {least:g} s cannot be over {deadline}"
                    yield self.fault("E208", what, deadline.span, "a longer `within`")
            if holds and self.grammar.follows_on(course.item):
                what = f"`{holds[0]}` stands behind things that follow one another"
                hint = "put `for` behind the one that must hold"
                expected = "one action, or several at the same time"
                yield self.fault("E216", what, holds[0].span, expected, hint)

    def together(self) -> Iterator[TaskFault]:
        for _, course in self.courses:
            if not isinstance(course, Together):
                continue
            parts = [self.grammar.sole_action(p) for p in course.parts]
            for i, a in enumerate(parts):
                for b in parts[i + 1 :]:
                    if a and b and self.contradict(a, b):
                        what = f"`{a}` and `{b}` can never hold at the same time"
                        yield self.fault("E209", what, course.span, hint="in turn is `a b`")

    def contradict(self, a: Action, b: Action) -> bool:
        one, other = self.actions.get(a.name), self.actions.get(b.name)
        if one is None or other is None:
            return False
        return {str(x) for x in a.actors} == {str(x) for x in b.actors} and contradict(one, other)

    def invariants(self) -> Iterator[TaskFault]:
        for invariant in self.parsed.task.invariants:
            for stage, action in self.grammar.asked:
                if invariant.during and invariant.during.stage != stage:
                    continue
                same = (action.name, {*action.actors}) == (
                    invariant.action.name,
                    {*invariant.action.actors},
                )
                breaks = same if invariant.when == "never" else False
                breaks = breaks or (
                    invariant.when == "always" and self.contradict(invariant.action, action)
                )
                if breaks:
                    what = f"`{invariant}`, but stage `<{stage}>` asks for `{action}`"
                    hint = "say for which stage it is meant with `during <stage>`"
                    yield self.fault("E210", what, invariant.span, hint=hint)
                    break

    def repetitions(self) -> Iterator[TaskFault]:
        for _, course in self.courses:
            if not isinstance(course, Repeated) or course.mark == "?":
                continue
            if self.grammar.may_be_left_out(course.item):
                what = f"`{course.mark}` repeats what may be left out, so it has no end"
                hint = "leave the `?` or `*` inside away"
                yield self.fault("E215", what, course.span, hint=hint)


def _slip(name: str, other: str) -> bool:
    """Whether one name looks like a slip of the pen for another; `arm1` is none for `arm2`."""
    if name == other or name.rstrip("0123456789_") == other.rstrip("0123456789_"):
        return False
    return SequenceMatcher(None, name.casefold(), other.casefold()).ratio() >= ALIKE


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"
