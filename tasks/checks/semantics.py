"""Semantic checks: known names, correct actors, reachable stages.

Courses and their clauses are checked in `courses.py`. Each check reports a fault at its position, and none
that merely follows from another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from collections.abc import Set as AnySet
from dataclasses import dataclass, replace
from functools import cached_property

from visup.agent.model.did_you_mean import closest, did_you_mean
from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.rules.language.synonyms import meant_word
from visup.tasks.actions.actions import ACTIONS, ActionDefinition
from visup.tasks.checks.ambiguity import AmbiguityCheck
from visup.tasks.checks.bounds import BoundsCheck
from visup.tasks.checks.courses import CourseCheck
from visup.tasks.checks.criteria import ActorUseCheck, criteria_faults
from visup.tasks.checks.names import NameCheck
from visup.tasks.diagnostics.recovery import ParsedFile
from visup.tasks.grammar.analysis import Grammar
from visup.tasks.grammar.conditions import action_of, actors_of, facts_of
from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Comparison,
    Conditioned,
    Course,
    Name,
    Reference,
    Stage,
    walk,
)
from visup.tasks.grammar.statement import RESERVED_WORDS


def check_semantics(
    parsed: ParsedFile,
    source: Source,
    actions: Mapping[str, ActionDefinition],
    percepts: AnySet[str],
) -> list[Diagnostic]:
    """All semantic mistakes in the parsed part of a file.

    Args:
        parsed: The tree, and information about statements that did not parse.
        source: For positions.
        actions: The available actions.
        percepts: The available kinds of percept.

    Returns:
        Faults in no particular order.
    """
    if not parsed.task.stages:
        return []
    return list(_Semantics(parsed, source, actions, percepts).faults())


@dataclass(frozen=True)
class _Semantics:
    parsed: ParsedFile
    source: Source
    actions: Mapping[str, ActionDefinition]
    percepts: AnySet[str]

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
    def uses(self) -> list[tuple[str, tuple[Name, ...], Span]]:
        """Every action of the file: (action, actors, span)."""
        task = self.parsed.task
        facts = [c for _, c in self.courses if isinstance(c, Action | Comparison)]
        signs = (s for _, c in self.courses if isinstance(c, Conditioned) for s in c.conditions)
        conditions = [s.condition for s in signs] + [i.condition for i in task.invariants]
        facts += [f for c in conditions for f in facts_of(c)]
        uses = [(action_of(f).name, actors_of(f), action_of(f).span) for f in facts]
        uses += [
            (s.name, s.body.names, s.span)
            for s in task.stages
            if isinstance(s.body, Actors) and not self.intended_meaning(s)
        ]
        return uses

    @cached_property
    def heads(self) -> set[int]:
        """Identities of the spans of heads."""
        return {id(s.span) for s in self.parsed.task.stages}

    def faults(self) -> Iterator[Diagnostic]:
        yield from self.unbracketed_lists()
        yield from self.reserved()
        yield from self.unknown_actions()
        yield from self.actors_of_actions()
        yield from self.references()
        yield from self.duplicates()
        if not self.parsed.faults:
            yield from self.unreachable()
            actor_uses = ActorUseCheck(self.parsed.task, self.source, self.uses, self.undefined)
            yield from actor_uses.misspelt_actors()
            yield from actor_uses.unused_actors()
        all_defined = not (self.undefined or self.parsed.faults)
        yield from CourseCheck(
            self.parsed.task, self.source, self.actions, all_defined, self.grammar
        ).faults()
        yield from criteria_faults(self.parsed.task, self.source)
        yield from NameCheck(
            self.parsed, self.source, self.actions, self.percepts, self.uses
        ).faults()
        if all_defined:
            bounds = list(BoundsCheck(self.grammar, self.source).faults())
            yield from bounds
        if all_defined and not bounds:
            yield from AmbiguityCheck(self.parsed.task, self.source, self.grammar).faults()

    def intended_meaning(self, stage: Stage) -> str:
        """The intended meaning of a plain list of names that is no action, or empty."""
        if not isinstance(stage.body, Actors) or stage.name in self.actions:
            return ""
        names = [str(n) for n in stage.body.names]
        if names[0] in self.actions:
            return "action"
        if len(names) == 3 and names[1] in self.actions:
            return "infix"
        defined = self.defined
        are_stages = all(n in defined and n != stage.name for n in names)
        return "stages" if are_stages else ""

    @cached_property
    def defined(self) -> set[str]:
        return {s.name for s in self.parsed.task.stages}

    def unbracketed_lists(self) -> Iterator[Diagnostic]:
        for stage in self.parsed.task.stages:
            if not isinstance(stage.body, Actors):
                continue
            names = [str(n) for n in stage.body.names]
            match self.intended_meaning(stage):
                case "action":
                    corrected = f"`{names[0]}({', '.join(names[1:]) or '...'})`"
                    what = f"the actors of `{names[0]}` are written without brackets"
                    yield self.source.fault("E219", what, stage.body.span, corrected)
                case "infix":
                    what = f"`{names[1]}` is written between its actors"
                    corrected = f"`{names[1]}({names[0]}, {names[2]})`"
                    yield self.source.fault("E219", what, stage.body.span, corrected)
                case "stages":
                    corrected = f"`{' '.join(f'<{n}>' for n in names)}`"
                    what = "stages are referred to without angle brackets"
                    yield self.source.fault("E220", what, stage.body.span, corrected)

    def reserved(self) -> Iterator[Diagnostic]:
        task = self.parsed.task
        named = [a for _, actors, _ in self.uses for a in actors]
        named += [Name(a.name, a.span) for a in task.declared]
        for name in named:
            if str(name) in RESERVED_WORDS:
                what = f"`{name}` is a reserved word"
                yield self.source.fault("E123", what, name.span, "another name")

    def unknown_actions(self) -> Iterator[Diagnostic]:
        reported = set()
        for name, _, span in self.uses:
            if name in self.actions or name in reported:
                continue
            reported.add(name)
            suggestion = meant_word(name, self.actions)
            expected = f"an action: {', '.join(sorted(ACTIONS))}, or a word of rules"
            width = replace(span, end_line=span.line, end_column=span.column + len(name))
            at = span if self.is_head(span) else width
            hint = f"did you mean `{suggestion}`?" if suggestion else None
            what = f"unknown action `{name}`"
            if self.is_head(span):
                what = f"`<{name}>` is given actors, but `{name}` is not an action"
            yield self.source.fault("E201", what, at, expected, hint)

    def is_head(self, span: Span) -> bool:
        return id(span) in self.heads

    def actors_of_actions(self) -> Iterator[Diagnostic]:
        for name, actors, span in self.uses:
            meaning = self.actions.get(name)
            if meaning is None:
                continue
            if len(actors) != meaning.arity:
                what = f"`{name}` is given {_count(len(actors), 'actor')}"
                expected = _count(meaning.arity, "actor")
                if "zone" in meaning.kinds:
                    expected = "an actor and a zone"
                yield self.source.fault("E205", what, span, expected)
            elif len({str(a) for a in actors}) < len(actors):
                what = f"`{name}` between `{actors[0]}` and itself"
                yield self.source.fault("E211", what, span, "different actors")

    @cached_property
    def undefined(self) -> dict[str, Reference]:
        """The first reference to each stage that is not defined."""
        known = {s.name for s in self.parsed.task.stages} | self.parsed.defined
        found: dict[str, Reference] = {}
        references = [c for _, c in self.courses if isinstance(c, Reference)]
        references += [r for i in self.parsed.task.invariants for r in i.during]
        references += self.parsed.task.recovered
        for r in references:
            if not {r.stage, r.stage.split("(")[0]} & known and not self.parsed.lacking:
                found.setdefault(r.stage, r)
        return found

    def references(self) -> Iterator[Diagnostic]:
        defined = [s.name for s in self.parsed.task.stages]
        heads = self.heads_without_sign()
        once = {(r.span.line, r.span.column): name for name, r in self.undefined.items()}
        for name in once.values():  # in a loop the same mistake is made for each actor
            reference = self.undefined[name]
            if name in heads:
                what = f"`::=` is missing after `<{name}>`"
                yield self.source.fault("E102", what, heads[name].span, f"`<{name}> ::= ...`")
                continue
            expected = f"a rule `<{name}> ::= ...`"
            if name in self.actions:
                expected = f"a rule `<{name}> ::= arm satellite`, or `{name}(arm, satellite)`"
            hint = did_you_mean(name, defined, "`<{}>`")
            what = f"stage `<{name}>` is not defined"
            yield self.source.fault("E202", what, reference.span, expected, hint)

    def heads_without_sign(self) -> dict[str, Reference]:
        """Undefined stages at the beginning of a line, which may be rules without `::=`."""
        found: dict[str, Reference] = {}
        for _, c in self.courses:
            if isinstance(c, Reference) and c.stage in self.undefined:
                line = self.source.at(c.span).text
                rest = line[c.span.end_column - 1 :].strip()
                if not line[: c.span.column - 1].strip() and rest:
                    found.setdefault(c.stage, c)
        return found

    def duplicates(self) -> Iterator[Diagnostic]:
        first: dict[str, Span] = {}
        for stage in self.parsed.task.stages:
            if stage.name in first:
                what = f"stage `<{stage.name}>` is defined twice"
                where = _line(first[stage.name])
                hint = f"it is also defined in {where}; if either will do, join both with `|`"
                yield self.source.fault("E203", what, stage.span, "one rule for each stage", hint)
            first.setdefault(stage.name, stage.span)
        declared: dict[str, Span] = {}
        for actor in self.parsed.task.actors:
            if actor.name in declared:
                what = f"actor `{actor.name}` is declared twice"
                hint = f"it is also declared in {_line(declared[actor.name])}"
                yield self.source.fault("E212", what, actor.span, "`or` between its models", hint)
            declared.setdefault(actor.name, actor.span)

    def unreachable(self) -> Iterator[Diagnostic]:
        recovered = {r.stage for r in self.parsed.task.recovered}
        if self.heads_without_sign() or recovered & self.undefined.keys():
            return  # what follows such a failure is not reached either
        missing = {closest(u, self.grammar.stages) for u in self.undefined}
        misread = {
            str(n)
            for s in self.parsed.task.stages
            if isinstance(s.body, Actors) and self.intended_meaning(s)
            for n in s.body.names
        }
        roots = self.parsed.task.roots
        for stage in self.grammar.unreachable():
            if stage.name not in missing | misread and not stage.span.file:
                what = f"task `{roots[0]}` never reaches stage `<{stage.name}>`"
                if len(roots) > 1:
                    what = f"no task of the file reaches stage `<{stage.name}>`"
                hint = "refer to it from another stage, or take it out; the first rule is the task"
                yield self.source.fault("E204", what, stage.span, hint=hint)


def _line(span: Span) -> str:
    return f"line {span.line}{' of ' + span.file if span.file else ''}"


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"
