"""Tree rewriting: substituting objects for variables, and binding `let`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any, cast

from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    MOfN,
    Node,
    Not,
    Or,
    PastOperator,
    Predicate,
    Previous,
    Quantified,
    Since,
    Until,
)
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Variable,
    WindowFunction,
)

_PARTS: dict[type, tuple[str, ...]] = {
    Let: ("value", "at", "part"),
    **dict.fromkeys((Since, Until, Comparison, Arithmetic), ("left", "right")),
    **dict.fromkeys(
        (Not, PastOperator, FutureOperator, Previous, MOfN, Last, Quantified), ("part",)
    ),
    **dict.fromkeys((Negative, WindowFunction), ("part",)),
}
"""Node type -> fields that hold its children."""


def rebuilt(node: Node, change: Callable[[Node], Node | None]) -> Node:
    """Rewrite a tree.

    Args:
        node: The root.
        change: Returns the replacement of a node, or None to descend into its children.
    """
    changed = change(node)
    if changed is not None:
        return changed
    if isinstance(node, And | Or | PointwiseFunction):
        return replace(node, parts=tuple(rebuilt(p, change) for p in node.parts))  # type: ignore[arg-type]
    names = _PARTS.get(type(node), ())
    changes: dict[str, Any] = {n: rebuilt(getattr(node, n), change) for n in names}
    return replace(node, **changes) if changes else node


def substituted(node: Node, names: Mapping[str, str]) -> Node:
    """Replace variables by the names of objects."""

    def change(part: Node) -> Node | None:
        if isinstance(part, Predicate | Measure):
            return replace(part, arguments=tuple(names.get(w, w) for w in part.arguments))
        return None

    return rebuilt(node, change)


def bound(node: Formula, variable: Variable) -> Formula:
    """Bind a `let` variable in a formula."""

    def change(part: Node) -> Node | None:
        free = isinstance(part, Variable) and part.part is None and part.name == variable.name
        return replace(variable, span=part.span) if free else None  # type: ignore[union-attr]

    found: Any = rebuilt(node, change)
    return cast("Formula", found)


def cut_off(
    node: And | Or, free: Callable[[Formula], Collection[str]]
) -> tuple[Quantified, Formula, Quantified] | None:
    """A quantifier that ends before the last use of its variable, as in `exists c: f(c) and g(c)`.

    Args:
        node: A conjunction or disjunction.
        free: The objects that a formula names and does not bind.

    Returns:
        The quantifier, all from it on, and the quantifier about all of that; None if there is none.
    """
    for n, part in enumerate(node.parts):
        later = node.parts[n + 1 :]
        if isinstance(part, Quantified) and any(part.variable in free(x) for x in later):
            whole = replace(part, part=replace(node, parts=(part.part, *later)))
            return part, replace(node, parts=node.parts[n:]), whole
    return None
