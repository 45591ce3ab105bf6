"""Tasks drawn at random, to be recognised: small ones with everything, large ones to be followed."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass

from tests.oracles.recognition_oracle import OPTIONAL, SEEN, Expr, Rules

KEYS = ("a", "b", "c", "d", OPTIONAL)
SPANS_S = (0.04, 0.1, 0.5, 1.0, 3.0)


@dataclass(frozen=True)
class Draw:
    """Draws a small grammar with everything that the language has.

    Attributes:
        rng: The chance.
    """

    rng: random.Random

    def rules(self) -> Rules:
        """Stages `t`, `u` and `v`, of which each may refer to later ones, and come back to earlier."""
        return Rules({name: self.stage(name) for name in "tuv"})

    def stage(self, name: str) -> Expr:
        """The course of one stage, sometimes one that may begin anew after a step of its own."""
        body = self.expr(name, 2)
        if self.rng.random() < 0.3:
            back = ("ref", self.rng.choice("tuv"[: "tuv".index(name) + 1]))
            return ("alt", body, ("seq", self.act(), back))
        return body

    def act(self) -> Expr:
        """A step that cannot be left out."""
        key = self.rng.choice(KEYS[:-1])
        return ("hold", key, 2.0) if self.rng.random() < 0.2 else ("act", key)

    def expr(self, name: str, depth: int) -> Expr:
        """A course."""
        later = "tuv"["tuv".index(name) + 1 :]
        pick = self.rng.random()
        if depth == 0 or pick < 0.12:
            return self.act() if self.rng.random() < 0.85 else ("act", OPTIONAL)
        if pick < 0.3 and later:
            return ("ref", self.rng.choice(later))
        if pick < 0.65:
            kind = self.rng.choice(("seq", "seq", "alt", "any", "and"))
            several = 3 if kind == "seq" and self.rng.random() < 0.4 else 2
            return (kind, *(self.expr(name, depth - 1) for _ in range(several)))
        # What is repeated cannot be left out: the language refuses that.
        item: Expr = self.act()
        if self.rng.random() < 0.4:
            item = ("seq", item, self.expr(name, 0))
        if pick < 0.85:
            return ("rep", self.rng.choice("?*+"), item)
        least = self.rng.randrange(3)
        return ("times", least, self.rng.choice((None, least + 1, least + 2)), item)

    def stream(self, steps: int) -> list[tuple[float, Mapping[str, tuple[str, float]]]]:
        """What is seen, step by step: seconds since the step before, and verdicts with confidence."""
        told: list[tuple[float, Mapping[str, tuple[str, float]]]] = []
        for i in range(steps):
            seen = {
                key: (self.rng.choice(SEEN), self.rng.choice((1.0, self.rng.random())))
                for key in KEYS
                if self.rng.random() < 0.8
            }
            told.append((self.rng.choice(SPANS_S) if i else 0.0, seen))
        return told


def text_of(rules: Rules) -> str:
    """A grammar in the task language."""
    stages = "\n".join(f"<{name}> ::= {_said(expr)}" for name, expr in rules.stages.items())
    return f"optional actor o\n{stages}"


def _said(expr: Expr) -> str:
    kind, parts = expr[0], expr[1:]
    if kind == "act":
        return f"{parts[0]}({'o' if parts[0] == OPTIONAL else 'x'})"
    if kind == "hold":
        return f"{parts[0]}(x) for {parts[1]:g} s"
    if kind == "ref":
        return f"<{parts[0]}>"
    if kind == "rep":
        return f"({_said(parts[1])}){parts[0]}"
    if kind == "times":
        least, most, item = parts
        above = "" if most is None else f" at most {most} times"
        return f"({_said(item)}) at least {least} times{above}"
    if kind == "any":
        return f"any order ({', '.join(_said(p) for p in parts)})"
    joint = {"seq": " ", "alt": " | ", "and": " & "}[kind]
    return joint.join(f"({_said(p)})" for p in parts)


def large_task(stages: int, rng: random.Random) -> str:
    """A task of so many stages, each with an action of its own, with alternatives and loops."""
    names = [f"s{i}" for i in range(stages)]
    lines = [f"<{n}> ::= act_{n}(x)" for n in names]
    body = " ".join(_block(names, rng))
    return "\n".join([f"<t> ::= {body}", *lines])


def _block(names: list[str], rng: random.Random) -> list[str]:
    """Stages in a row, some of them as alternatives, some repeated, some left out at will."""
    said, rest = [], [f"<{n}>" for n in names]
    while rest:
        size = min(len(rest), rng.choice((1, 1, 2, 3, 4)))
        some, rest = rest[:size], rest[size:]
        pick = rng.random()
        if size == 1:
            said.append(some[0] if pick < 0.8 else f"{some[0]}?")
        elif pick < 0.4:
            half = size // 2
            said.append(f"({' '.join(some[:half])} | {' '.join(some[half:])})")
        elif pick < 0.7:
            said.append(f"({' '.join(some)})+")
        else:
            said.append(" ".join(some))
    return said
