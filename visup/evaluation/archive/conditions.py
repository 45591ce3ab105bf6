"""Random conditions about two objects, drawn from all operators of the rule language."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

RELATIONS = (
    *("converging", "diverging", "keeping_distance", "touching", "coupled"),
    *("north_of", "moving_towards", "close_to", "partially_overlapping"),
)
MAX_DEPTH = 3
"""Maximum nesting of operators."""


def random_conditions(count: int, seed: int) -> list[str]:
    """Conditions about `a` and `b`, all different."""
    rng, conditions = Random(seed), dict[str, None]()
    while len(conditions) < count:
        text = _condition(rng, rng.randint(0, MAX_DEPTH))
        if "a" in text and "b" in text:
            conditions[text] = None
    return list(conditions)


def _condition(rng: Random, depth: int) -> str:
    if depth == 0 or rng.random() < 0.15:
        names = ("a, b", "b, a")
        return rng.choice(
            [f"{rng.choice(RELATIONS)}({rng.choice(names)})"] * 6
            + ["gap(a, b) < 60 px", "(moving(a) and touching(a, b))"]
        )

    def operand() -> str:
        return f"({_condition(rng, depth - 1)})"

    duration = f"{rng.choice((0.2, 0.7, 1.5))} s"
    operators: list[Callable[[], str]] = [
        lambda: f"{operand()} and {operand()}",
        lambda: f"{operand()} or {operand()}",
        lambda: f"not {operand()}",
        lambda: f"{operand()} implies {operand()}",
        lambda: f"{operand()} within {duration}",
        lambda: f"{operand()} for {duration}",
        lambda: f"{operand()} within 0.3 s to 1.1 s ago",
        lambda: f"{operand()} for 0.3 s to 1.1 s ago",
        lambda: f"once {operand()}",
        lambda: f"always {operand()}",
        lambda: f"previous {operand()}",
        lambda: f"{operand()} since {operand()}",
        lambda: f"{operand()} since[{duration}] {operand()}",
        lambda: f"{operand()} until[{duration}] {operand()}",
        lambda: f"{operand()} release[{duration}] {operand()}",
        lambda: f"eventually[{duration}] {operand()}",
        lambda: f"henceforth[{duration}] {operand()}",
        lambda: f"{operand()} in 60 % of {duration}",
        lambda: f"{operand()} in 2 of 4 samples",
        lambda: f"last({operand()}, {duration})",
        lambda: f"(exists c: (touching(b, c) and converging(a, c))) or {operand()}",
        lambda: f"(exists c: converging(a, c)) and {operand()}",
        lambda: f"{operand()} and (forall c: not touching(a, c))",
    ]
    return rng.choice(operators)()
