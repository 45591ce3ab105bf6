"""Templates: stages with actors as parameters, and recoveries from failure.

`<mount(leg)> ::= ...` is a template. Each reference `<mount(leg_1)>` instantiates it as a separate stage; the
template itself is no stage. `on failure of <grasp>: <back_off> <grasp>` adds that alternative to every
reference to `<grasp>`.

Read before: `nodes.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, cast

from visup.rules.formula.units import NOWHERE, Span
from visup.tasks.grammar.ast_courses import Choice, Course, Reference
from visup.tasks.grammar.conditions import Name
from visup.tasks.grammar.nodes import Invariant, Stage

WAYS_OUT = 3
"""Maximum number of recoveries in a row."""
_CALL = re.compile(r"(\w+)\s*\(([^()]*)\)")


@dataclass(frozen=True, slots=True)
class Recovery:
    """`on failure of <grasp>: <back_off> <grasp>`: an alternative after the failure of a stage.

    Attributes:
        stage: The stage.
        course: The course that follows the failure.
    """

    stage: Reference
    course: Course
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"on failure of {self.stage}: {self.course}"


def called(name: str) -> tuple[str, tuple[str, ...]]:
    """The name of a stage without its actors, and the actors.

    >>> called("mount(leg_1, top)")
    ('mount', ('leg_1', 'top'))
    """
    found = _CALL.fullmatch(name)
    if found is None:
        return name, ()
    return found[1], tuple(w.strip() for w in found[2].split(","))


def canonical(name: str) -> str:
    """The name of a stage with normalised spaces."""
    plain, words = called(name.strip())
    return f"{plain}({', '.join(words)})" if words else plain


def recovered(stages: Iterable[Stage], recoveries: Iterable[Recovery]) -> tuple[Stage, ...]:
    """The stages with every recovery added as an alternative."""
    found = tuple(stages)
    for recovery in recoveries:
        way = _recovery_course(recovery, WAYS_OUT)
        found = tuple(
            s
            if s.name == recovery.stage.stage
            else replace(s, body=_replaced(s.body, recovery.stage, way))
            for s in found
        )
    return found


def _recovery_course(recovery: Recovery, times: int) -> Course:
    if times == 0:
        return recovery.stage
    again = _replaced(recovery.course, recovery.stage, _recovery_course(recovery, times - 1))
    return Choice((recovery.stage, cast("Course", again)), recovery.span)


def _replaced(node: Any, old: Reference, new: Course) -> Any:
    return _mapped(node, lambda n: new if isinstance(n, Reference) and n == old else None)


def instantiated(
    stages: Iterable[Stage], invariants: Iterable[Invariant] = ()
) -> tuple[Stage, ...]:
    """The stages with each template replaced by its instances.

    A stage referred to by exactly its own name is no template; an unused template remains, so that it is
    reported as an unreachable stage.
    """
    known = {s.name: s for s in reversed(tuple(stages))}
    patterns = {_shape(s.name): s for s in reversed(tuple(stages)) if called(s.name)[1]}
    if not patterns:
        return tuple(stages)
    todo = [n for s in stages if not called(s.name)[1] for n in _asked(s)]
    todo += [n for i in invariants for n in _asked(i)]
    made: dict[str, Stage] = {}
    plain: set[str] = set()
    while todo:
        name = todo.pop(0)
        if name in made or name in plain:
            continue
        if name in known:
            plain.add(name)
            todo += _asked(known[name])
        elif _shape(name) in patterns:
            made[name] = _bound(patterns[_shape(name)], called(name)[1])
            todo += _asked(made[name])
    found: list[Stage] = []
    for stage in stages:
        of = [m for m in made.values() if m.span == stage.span and m.span != NOWHERE]
        found += of if of and stage.name not in plain else [*of, stage]
    return tuple(found)


def _shape(name: str) -> tuple[str, int]:
    """The key of a template: its plain name and its number of actors."""
    plain, words = called(name)
    return plain, len(words)


def bound(node: Any, names: Mapping[str, str]) -> Any:
    """The tree with actors substituted."""

    def changed(n: Any) -> Any:
        if isinstance(n, Name) and n in names:
            return Name(names[n], n.span)
        if isinstance(n, Reference):
            plain, words = called(n.stage)
            new = tuple(names.get(w, w) for w in words)
            return replace(n, stage=canonical(f"{plain}({', '.join(new)})")) if words else None
        return None

    return _mapped(node, changed)


def names_in(node: Any) -> frozenset[str]:
    """The actors, zones and signals in a tree, including the arguments of stages."""
    found: set[str] = set()

    def note(n: Any) -> None:
        if isinstance(n, Name):
            found.add(str(n))
        if isinstance(n, Reference):
            found.update(called(n.stage)[1])

    _mapped(node, note)
    return frozenset(found)


def _bound(pattern: Stage, words: tuple[str, ...]) -> Stage:
    plain, parameters = called(pattern.name)
    names = dict(zip(parameters, words, strict=True))
    body = bound(pattern.body, names)
    return replace(pattern, name=canonical(f"{plain}({', '.join(words)})"), body=body)


def _asked(node: Any) -> list[str]:
    """The stages that a node refers to."""
    found: list[str] = []

    def note(n: Any) -> None:
        if isinstance(n, Reference):
            found.append(n.stage)

    _mapped(node, note)
    return found


def _mapped(node: Any, change: Callable[[Any], Any]) -> Any:
    """A tree with nodes replaced by `change`; for None the node is kept and its children are visited."""
    new = change(node)
    if new is not None:
        return new
    if isinstance(node, str | Span):
        return node
    if isinstance(node, tuple):
        return tuple(_mapped(n, change) for n in node)
    fields = getattr(node, "__dataclass_fields__", None)
    if fields is None:
        return node
    return replace(node, **{f: _mapped(getattr(node, f), change) for f in fields})
