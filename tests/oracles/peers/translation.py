"""A peer's formula as source text of our language, with what it means by its operators kept."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Tree = Mapping[str, Any]


class NotExpressibleError(Exception):
    """Our language has nothing like it."""


def word(name: str) -> str:
    """The name of a signal in our language."""
    return "v_" + "".join(c if c.isalnum() else "_" for c in name)


def walk(tree: Tree) -> Iterator[Tree]:
    """A tree and all its parts."""
    yield tree
    for part in tree.get("args", ()):
        yield from walk(part)


@dataclass(frozen=True)
class Translator:
    """Writes the formulas of one case.

    Attributes:
        peer: Whose it is.
        span: How long the recording is, seconds or samples: so far a future without end looks.
        both_asked: Whether `since` and `until` ask for both sides at the moment of b.
        later_left: Whether `until[lo, hi]` asks a only from now + lo on.
        numeric_iff: Whether iff is -|a - b| and xor |a - b|.
        previous_false: Whether `previous` is false where there is no sample before.
        samples: Whether time counts samples.
    """

    peer: str
    span: float
    both_asked: bool
    later_left: bool
    numeric_iff: bool
    previous_false: bool
    samples: bool

    def formula(self, tree: Tree) -> str:
        """Where something true or false stands."""
        op, args = tree["op"], tree.get("args", ())
        match op:
            case "true" | "false":
                return str(op)
            case "variable" | "constant" | "add" | "subtract" | "multiply" | "divide":
                return f"({self.term(tree)} > 0)"
            case "abs" | "sqrt" | "exp" | "power":
                return f"({self.term(tree)} > 0)"
            case "proposition":
                return f"({word(tree['name'])}() > 0)"
            case "predicate":
                left, right = map(self.term, args)
                return f"({left} {tree['comparison']} {right})"
            case "not":
                return f"(not {self.formula(args[0])})"
            case "and" | "or":
                return f"({f' {op} '.join(map(self.formula, args))})"
            case "iff" | "xor" if self.numeric_iff and self._margins(args):
                left, right = map(self.margin, args)
                return f"({left} {'==' if op == 'iff' else '!='} {right})"
            case "implies" | "iff" | "xor":
                left, right = map(self.formula, args)
                return f"({left} {op} {right})"
        return self._temporal(op, tree, [self.formula(a) for a in args])

    def _temporal(self, op: str, tree: Tree, parts: list[str]) -> str:
        steps = tree.get("steps", 1)
        match op:
            case "previous" if not self.previous_false:
                return f"({parts[0]} for {steps} s to {steps} s ago)"
            case "previous" | "strong_previous":
                return f"({parts[0]} within {steps} s to {steps} s ago)"
            case "next":
                return f"(henceforth[{steps} s .. {steps} s] {parts[0]})"
            case "strong_next":
                return f"(eventually[{steps} s .. {steps} s] {parts[0]})"
            case "rise":
                return f"({parts[0]} and not ({parts[0]} within 1 s to 1 s ago))"
            case "fall":
                return f"(({parts[0]} for 1 s to 1 s ago) and not {parts[0]})"
        low, high = tree.get("bounds", (0, "inf"))
        endless = high == "inf"
        if low == high == 0:
            return self._now(op, parts)
        if op in ("once", "historically", "since", "trigger"):
            return self._past(op, parts, float(low), None if endless else float(high))
        return self._future(op, parts, float(low), self.span if endless else float(high))

    def _now(self, op: str, parts: list[str]) -> str:
        """A window of the present moment alone, which needs no window."""
        if op in ("since", "until") and self.both_asked:
            return f"({parts[0]} and {parts[1]})"
        return parts[-1]

    def _past(self, op: str, parts: list[str], low: float, high: float | None) -> str:
        if op == "trigger":
            one, other = (f"(not {p})" for p in parts)
            return f"(not {self._past('since', [one, other], low, high)})"
        if op == "since":
            return self._since(parts[0], parts[1], low, high)
        kind = "once" if op == "once" else "always"
        if high is None:
            part = parts[0] if low == 0 else f"({kind}{_window(low, low)} {parts[0]})"
            return f"({kind} {part})"
        return f"({kind}{_window(low, high)} {parts[0]})"

    def _since(self, f: str, g: str, low: float, high: float | None) -> str:
        g = f"({f} and {g})" if self.both_asked else g
        if high is not None:
            found = f"({f} since{_window(low, high)} {g})"
        elif low == 0:
            found = f"({f} since {g})"
        else:
            # Since then, and ever since that moment: the two join where the window ends.
            after = f"({f} for {_seconds(low - 1)})" if self.samples and low > 1 else f
            if not self.samples:
                after = f"({f} for {_seconds(low)})"
            found = f"(({f} since {g}) within {_seconds(low)} to {_seconds(low)} ago and {after})"
        return found

    def _future(self, op: str, parts: list[str], low: float, high: float) -> str:
        match op:
            case "always":
                return f"(henceforth{_window(low, high)} {parts[0]})"
            case "eventually":
                return f"(eventually{_window(low, high)} {parts[0]})"
            case "release":
                return f"({parts[0]} release{_window(low, high)} {parts[1]})"
            case "precedes":
                return self._precedes(parts[0], parts[1], low, high)
        f, g = parts
        if self.later_left and low > 0:
            inner = f"({f} until{_window(0, high - low)} {g})" if high > low else g
            return f"(eventually{_window(low, low)} {inner})"
        reached = f"({f} and {g})" if self.both_asked else g
        return f"({f} until{_window(low, high)} {reached})"

    def _precedes(self, f: str, g: str, low: float, high: float) -> str:
        """Until, told when its window is over, and cut where the recording begins."""
        if not self.samples or high > 20:
            raise NotExpressibleError("precedes over time without samples")
        found = []
        for ago in range(int(high - low) + 1):
            reached = g if ago == 0 else f"({g} within {ago} s to {ago} s ago)"
            if ago < high:
                reached = f"({reached} and {f} for {ago + 1} s to {int(high)} s ago)"
            found.append(reached)
        return f"({' or '.join(found)})" if len(found) > 1 else found[0]

    def term(self, tree: Tree) -> str:
        """Where a quantity stands."""
        op, args = tree["op"], tree.get("args", ())
        match op:
            case "variable" | "proposition":
                return f"{word(tree['name'])}()"
            case "constant":
                return _number(tree["value"])
            case "add" | "subtract" | "multiply" | "divide":
                # The data repeat the operands of sums: `req + gnt` has four.
                half = len(args) // 2
                if op == "add" and len(args) > 2 and args[:half] == args[half:]:
                    args = args[:half]
                sign = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}[op]
                return f"({f' {sign} '.join(map(self.term, args))})"
            case "abs" | "sqrt" | "exp" | "power":
                return f"{op}({', '.join(map(self.term, args))})"
        raise NotExpressibleError(f"{op} where a quantity stands")

    def margin(self, tree: Tree) -> str:
        """The robustness of a formula of one moment as a quantity."""
        if tree["op"] == "predicate":
            left, right = map(self.term, tree["args"])
            if tree["comparison"] in (">", ">="):
                return f"({left} - {right})"
            if tree["comparison"] in ("<", "<="):
                return f"({right} - {left})"
            raise NotExpressibleError("the robustness of an equation as a quantity")
        if tree["op"] == "not":
            return f"(-{self.margin(tree['args'][0])})"
        if tree["op"] in ("and", "or"):
            parts = ", ".join(map(self.margin, tree["args"]))
            return f"{'min' if tree['op'] == 'and' else 'max'}({parts})"
        return self.term(tree)

    def _margins(self, args: list[Tree]) -> bool:
        try:
            return all(self.margin(a) for a in args)
        except NotExpressibleError:
            return False


def _number(value: float) -> str:
    return f"{value!r}" if value >= 0 else f"(-{-value!r})"


def _seconds(value: float) -> str:
    return f"{value:.9g} s"


def _window(low: float, high: float) -> str:
    return (
        f"[{_seconds(high)}]" if low == 0 and high > 0 else f"[{_seconds(low)} .. {_seconds(high)}]"
    )
