"""Random conditions about two objects, drawn from all operators of the rule language."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

RELATIONS = (
    *("converging", "diverging", "keeping_distance", "touching", "coupled"),
    *("north_of", "moving_towards", "close_to", "partially_overlapping"),
)
DEEPEST = 3


def random_conditions(count: int, seed: int) -> list[str]:
    """Conditions about `a` and `b`, all different."""
    rng, found = Random(seed), dict[str, None]()
    while len(found) < count:
        text = _condition(rng, rng.randint(0, DEEPEST))
        if "a" in text and "b" in text:
            found[text] = None
    return list(found)


def _condition(rng: Random, depth: int) -> str:
    if depth == 0 or rng.random() < 0.15:
        names = ("a, b", "b, a")
        return rng.choice(
            [f"{rng.choice(RELATIONS)}({rng.choice(names)})"] * 6
            + ["gap(a, b) < 60 px", "(moving(a) and touching(a, b))"]
        )

    def part() -> str:
        return f"({_condition(rng, depth - 1)})"

    span = f"{rng.choice((0.2, 0.7, 1.5))} s"
    operators: list[Callable[[], str]] = [
        lambda: f"{part()} and {part()}",
        lambda: f"{part()} or {part()}",
        lambda: f"not {part()}",
        lambda: f"{part()} implies {part()}",
        lambda: f"{part()} within {span}",
        lambda: f"{part()} for {span}",
        lambda: f"{part()} within 0.3 s to 1.1 s ago",
        lambda: f"{part()} for 0.3 s to 1.1 s ago",
        lambda: f"once {part()}",
        lambda: f"always {part()}",
        lambda: f"previous {part()}",
        lambda: f"{part()} since {part()}",
        lambda: f"{part()} since[{span}] {part()}",
        lambda: f"{part()} until[{span}] {part()}",
        lambda: f"{part()} release[{span}] {part()}",
        lambda: f"eventually[{span}] {part()}",
        lambda: f"henceforth[{span}] {part()}",
        lambda: f"{part()} in 60 % of {span}",
        lambda: f"{part()} in 2 of 4 samples",
        lambda: f"last({part()}, {span})",
        lambda: f"(exists c: (touching(b, c) and converging(a, c))) or {part()}",
        lambda: f"(exists c: converging(a, c)) and {part()}",
        lambda: f"{part()} and (forall c: not touching(a, c))",
    ]
    return rng.choice(operators)()
