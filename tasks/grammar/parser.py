"""Parses text to a tree by the grammar in `tasks.lark`."""

from __future__ import annotations

from collections.abc import Sequence as Several
from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal, Protocol, TypeVar, cast

from lark import Lark, Token

from visup.rules.formula.nodes import And, Not, Or
from visup.rules.formula.terms import Measure, Term
from visup.rules.formula.units import Span, Unit
from visup.tasks.grammar.actor_builder import ActorBuilder, span_of
from visup.tasks.grammar.ast_courses import ConditionKind
from visup.tasks.grammar.conditions import EVERY, Condition, Lasted, PartName, Period, Range, lasted
from visup.tasks.grammar.copies import (
    MAX_COPIES,
    MAX_ROUNDS,
    as_rounds,
    copy_names,
    for_each_copy,
    one_of,
    with_copies,
)
from visup.tasks.grammar.nodes import (
    Action,
    Actor,
    Already,
    Amount,
    AnyOrder,
    Choice,
    Clause,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Deadline,
    Delay,
    FloorPoint,
    Ground,
    Hold,
    Include,
    Invariant,
    Name,
    Number,
    Parameter,
    ParameterRef,
    Reference,
    Repeated,
    Sequence,
    Stage,
    StageCondition,
    Task,
    Timed,
    Together,
    ZoneDeclaration,
)
from visup.tasks.grammar.parts import with_parts
from visup.tasks.grammar.templates import Recovery, bound, canonical, instantiated, recovered

N = TypeVar("N")


class _Placed(Protocol):
    """A node with a source position."""

    @property
    def span(self) -> Span: ...


def read(text: str, file: str = "<text>") -> Task:
    """Parse a text without semantic checks.

    Args:
        text: A whole task file, or some of its statements.
        file: Its name, for messages.

    Returns:
        The tree; its names are not checked (see `check`).

    Raises:
        lark.exceptions.UnexpectedInput: At a syntax error.
    """
    return collect(read_statements(text), file)


def read_statements(text: str) -> list[object]:
    """The statements of a text in order.

    Raises:
        lark.exceptions.UnexpectedInput: At a syntax error.
    """
    # With a transformer the parser returns its result, which its types do not express.
    return cast("list[object]", parser().parse(text))


def tokens(text: str) -> list[Token]:
    """The tokens of a valid text in order.

    Raises:
        lark.exceptions.UnexpectedInput: At a syntax error.
    """
    reader = parser().parse_interactive(text)
    found = list(reader.iter_parse())
    reader.feed_eof(found[-1] if found else None)  # type: ignore[no-untyped-call]
    return found


def collect(statements: Several[object], file: str) -> Task:
    """The tree of some statements."""

    def of(kind: type[N]) -> tuple[N, ...]:
        return tuple(s for s in statements if isinstance(s, kind))

    invariants = of(Invariant)
    stages = instantiated(recovered(of(Stage), of(Recovery)), invariants)
    actors = with_copies([a for a in of(Actor) if not a.bystander], stages)
    invariants = for_each_copy(invariants, actors)
    return Task(
        stages=stages,
        actors=with_parts(actors, stages, invariants),
        invariants=invariants,
        zones=of(ZoneDeclaration),
        parameters=of(Parameter),
        includes=of(Include),
        file=file,
        grounds=of(Ground),
        bystanders=tuple(a for a in of(Actor) if a.bystander),
        recovered=tuple(r.stage for r in of(Recovery)),
    )


def grammar() -> str:
    """The text of `tasks.lark`."""
    return files("visup.tasks.grammar").joinpath("tasks.lark").read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def parser() -> Lark:
    """The parser of task files, which returns their statements."""
    return Lark(
        grammar(),
        parser="lalr",
        lexer="contextual",
        maybe_placeholders=False,
        transformer=_TaskBuilder(),  # during parsing: an intermediate Lark tree would take half of the time
    )


class _TaskBuilder(ActorBuilder):
    """One method for each grammar rule."""

    def start(self, items: list[Any]) -> list[Any]:
        return items

    def stage(self, items: list[Any]) -> Stage:
        marked = items[0].type == "TASK"
        head, *rest = items[1:] if marked else items
        text = str(rest[0])[1:-1] if isinstance(rest[0], Token) else ""
        return Stage(_bare(head), rest[-1], text, marked, span_of(head))

    def size(self, items: list[Amount]) -> Amount:
        return items[0]

    def zone(self, items: list[Any]) -> ZoneDeclaration:
        name, *corners = items
        if corners and isinstance(corners[0][0], Number):
            return ZoneDeclaration(str(name), (), span_of(name), tuple(corners))
        return ZoneDeclaration(str(name), tuple(corners), span_of(name))

    def ground(self, items: list[Any]) -> Ground:
        word, *points = items
        image, floor = zip(*points, strict=True)
        return Ground(image, floor, span_of(word))

    def point(self, items: list[Any]) -> tuple[tuple[float, float], FloorPoint]:
        return items[0], items[1]

    def floor(self, items: list[Number]) -> FloorPoint:
        return items[0], items[1]

    def length(self, items: list[Token]) -> Number:
        return Number(float(items[0]), str(items[1]), span_of(items[0]).to(span_of(items[1])))

    def corner(self, items: list[Token]) -> tuple[float, float]:
        return float(items[0]), float(items[1])

    def parameter(self, items: list[Any]) -> Parameter:
        return Parameter(str(items[0]), items[1], span_of(items[0]))

    def include(self, items: list[Token]) -> Include:
        return Include(str(items[0])[1:-1], span_of(items[0]))

    def invariant(self, items: list[Any]) -> Invariant:
        when = cast('Literal["never", "always"]', str(items[0]))
        lasting = next((i for i in items if isinstance(i, Hold)), None)
        during = next((i for i in items if isinstance(i, tuple)), ())
        span = span_of(items[0]).to(during[-1].span if during else items[-1].span)
        return Invariant(when, items[1], lasting, during, span)

    def during(self, items: list[Reference]) -> tuple[Reference, ...]:
        return tuple(items)

    def choice(self, items: list[Course]) -> Choice:
        return Choice(tuple(items), _all(items))

    def sequence(self, items: list[Course]) -> Sequence:
        return Sequence(tuple(items), _all(items))

    def together(self, items: list[Course]) -> Together:
        return Together(tuple(items), _all(items))

    def any_order(self, items: list[Any]) -> AnyOrder:
        return AnyOrder(tuple(items[1:-1]), span_of(items[0]).to(span_of(items[-1])))

    def any_of(self, items: list[Any]) -> AnyOrder:
        first, count, *courses, last = items
        return AnyOrder(tuple(courses), span_of(first).to(span_of(last)), int(count))

    def for_each(self, items: list[Any]) -> AnyOrder:
        first, variable, *actors, course = items
        made = (bound(course, {str(variable): str(a)}) for a in actors)
        return AnyOrder(tuple(made), span_of(first).to(course.span))

    def for_copies(self, items: list[Any]) -> AnyOrder:
        first, said, plural, course = items
        name, count = one_of(str(plural), course), min(int(said), MAX_COPIES)
        made = (bound(course, {name: copy}) for copy in copy_names(name, count))
        return AnyOrder(tuple(made), span_of(first).to(course.span), copies=(name, count))

    def for_new(self, items: list[Any]) -> AnyOrder:
        first, _, said, course = items
        name = str(said)
        made = tuple(bound(course, {name: copy}) for copy in copy_names(name, MAX_ROUNDS))
        copies = (name, MAX_ROUNDS)
        return AnyOrder(made, span_of(first).to(course.span), copies=copies, least=1, new=name)

    def already(self, items: list[Any]) -> Already:
        return Already(items[1], span_of(items[0]).to(items[1].span))

    def recovery(self, items: list[Any]) -> Recovery:
        return Recovery(items[1], items[2], span_of(items[0]).to(items[2].span))

    def judged(self, items: list[Any]) -> Conditioned:
        return Conditioned(items[0], tuple(items[1:]), _all(items))

    def timed(self, items: list[Any]) -> Timed:
        return Timed(items[0], cast("tuple[Clause, ...]", tuple(items[1:])), _all(items))

    def counted(self, items: list[Any]) -> Course:
        bounds = {word: number for word, number, _ in items[1:]}
        span = items[0].span.to(items[-1][2])
        counted = Counted(items[0], bounds.get("least", 1), bounds.get("most"), span)
        return as_rounds(counted) or counted

    def at_least(self, items: list[Token]) -> tuple[str, int, Span]:
        return "least", int(items[1]), span_of(items[1])

    def at_most(self, items: list[Token]) -> tuple[str, int, Span]:
        return "most", int(items[1]), span_of(items[1])

    def repeated(self, items: list[Any]) -> Course:
        mark = cast('Literal["?", "*", "+"]', str(items[1]))
        repeated = Repeated(items[0], mark, items[0].span.to(span_of(items[1])))
        return as_rounds(repeated) or repeated

    def hold(self, items: list[Any]) -> Hold:
        return Hold(items[1], span_of(items[0]).to(items[1].span))

    def deadline(self, items: list[Any]) -> Deadline:
        return Deadline(items[1], span_of(items[0]).to(items[1].span))

    def delay(self, items: list[Any]) -> Delay:
        return Delay(items[1], _third(items), span_of(items[0]).to(items[-1].span))

    def sign(self, items: list[Any]) -> StageCondition:
        kind = cast("ConditionKind", str(items[0]))
        return StageCondition(kind, items[1], _third(items), span_of(items[0]).to(items[-1].span))

    def amount(self, items: list[Token]) -> Amount:
        span = span_of(items[0]).to(span_of(items[-1]))
        if len(items) == 1:
            return ParameterRef(str(items[0]), span)
        return Number(float(items[0]), str(items[1]), span)

    def action(self, items: list[Token]) -> Action:
        name, *actors, last = items
        words = tuple(a if isinstance(a, Name) else Name(str(a), span_of(a)) for a in actors)
        return Action(str(name), words, span_of(name).to(span_of(last)))

    signal = action

    def bare(self, items: list[Token]) -> Number:
        return Number(float(items[0]), Unit.NONE, span_of(items[0]))

    def part_of(self, items: list[Token]) -> Name:
        part, machine = items
        return PartName(
            str(part), Name(str(machine), span_of(machine)), span_of(part).to(span_of(machine))
        )

    def comparison(self, items: list[Any]) -> Comparison:
        quantity = Measure(items[0].name, items[0].arguments, items[0].span)
        span = quantity.span.to(items[-1].span)
        right = items[2] if len(items) == 3 else Range(items[2], items[3], _all(items[2:]))
        return Comparison(quantity, str(items[1]), cast("Term", right), span=span)

    def lasted(self, items: list[Any]) -> Lasted:
        return lasted(items[0], items[1].duration, items[0].span.to(items[1].span))

    def periodic(self, items: list[Any]) -> Comparison:
        action, _, *amounts = items
        again = Measure(action.name, action.arguments, action.span)
        span = amounts[0].span.to(amounts[-1].span)
        period = Period(amounts[0] if len(amounts) > 1 else None, amounts[-1], span)
        return Comparison(again, EVERY, cast("Term", period), span=action.span.to(span))

    def reference(self, items: list[Token]) -> Reference:
        return Reference(_bare(items[0]), span_of(items[0]))

    def or_(self, items: list[Condition]) -> Or:
        return Or(tuple(items), _all(items))

    def and_(self, items: list[Condition]) -> And:
        return And(tuple(items), _all(items))

    def not_(self, items: list[Any]) -> Not:
        return Not(items[1], span_of(items[0]).to(items[1].span))


def _bare(token: Token) -> str:
    """The name between the angle brackets."""
    return canonical(str(token)[1 : str(token).index(">")])


def _third(items: list[Any]) -> Any:
    return items[2] if len(items) > 2 else None


def _all(items: Several[_Placed]) -> Span:
    return items[0].span.to(items[-1].span)
