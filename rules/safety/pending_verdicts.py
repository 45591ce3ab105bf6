"""Verdicts of future rules that are undecided when a recording ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

import numpy as np

from visup.agent import Mind
from visup.rules.formula.nodes import Rule
from visup.rules.formula.truth import MAYBE
from visup.rules.formula.units import ticks
from visup.rules.monitoring.intervals import AtEnd
from visup.rules.monitoring.vm import CHOICE_BITS, Floats, Ints, find_true
from visup.rules.safety.compiled_rules import CompiledRules, compile_rules
from visup.rules.safety.reasoner import RuleMemory, rule_memory
from visup.rules.wording.sentences import sentence, with_names

MOMENT_SPACING = ticks(0.1)
"""Spacing of the moments at which pending verdicts are evaluated, microseconds."""
MAX_MOMENTS = 20_000
"""Most such moments: 33 minutes."""
POSSIBILITY_CONFIDENCE = 0.4
"""Confidence of a sentence about a possibility."""


@dataclass(frozen=True, slots=True)
class OpenRule:
    """A rule that counts as true of some objects although its verdict is pending.

    Attributes:
        rule: The rule.
        objects: Ids, in the order of its variables.
        text: Its sentence.
        decided: Whether no continuation could change it.
    """

    rule: Rule
    objects: tuple[int, ...]
    text: str
    decided: bool

    def __str__(self) -> str:
        how = "true by what was seen" if self.decided else "undecided, and counts as true"
        return f"At the end rule '{self.rule.name}' is {how}: {self.text}"


def open_rules(mind: Mind, at_end: AtEnd | str) -> tuple[OpenRule, ...]:
    """The rules that are true about the last moments of a recording.

    Args:
        mind: The mind after the last step.
        at_end: 'strong': those already decided. 'weak': also those that may still become true and are
            not suspended. 'unknown': none.

    Returns:
        One for each rule and set of objects without an active alert; in the order of the rules.
    """
    memory = rule_memory(mind)
    if at_end == "unknown" or memory.now is None or memory.after is None:
        return ()
    compiled = compile_rules(memory.rules, memory.early)
    strong = dict.fromkeys(_true_while_pending(compiled, memory, 0))
    weak = {} if at_end == "strong" else dict.fromkeys(_true_while_pending(compiled, memory, 1))
    found = {**strong, **weak}
    active = {key for key, held in memory.active.items() if held.until == inf}
    open_now: dict[tuple[str, frozenset[int]], OpenRule] = {}
    for rule, ids in found:
        key = (rule.name, frozenset(ids))
        if key not in active and key not in open_now:
            decided = (rule, ids) in strong
            words = with_names(rule.say, rule.variables)
            text = sentence(
                mind, words, *ids, confidence=1.0 if decided else POSSIBILITY_CONFIDENCE
            )
            open_now[key] = OpenRule(rule, ids, text, decided)
    return tuple(open_now.values())


def _true_while_pending(
    compiled: CompiledRules, memory: RuleMemory, bound: int
) -> Iterator[tuple[Rule, tuple[int, ...]]]:
    """Rules that are true at moments with pending verdicts.

    Args:
        compiled: The rules.
        memory: Their memory.
        bound: Whether lower bounds (0) or upper bounds (1) count.
    """
    n, delays = len(memory.ids), [places[0].delay for places in compiled.condition_refs]
    layout, rows = compiled.layout(n), compiled.search_table(n)[0]
    assert memory.now is not None
    assert memory.after is not None
    states, found = memory.after, np.empty(max(1, compiled.search_table(n)[1]), dtype=np.int64)
    for k in range(1, min(max(delays) // MOMENT_SPACING, MAX_MOMENTS) + 1):
        now, arena = memory.now + k * MOMENT_SPACING, _unknown_arena(compiled, n, layout.size)
        states = layout.step(states, now, np.full(layout.codes, MAYBE, dtype=np.int8), arena)
        for number, (rule, delay) in enumerate(zip(compiled.rules, delays, strict=True)):
            if now - delay > memory.now or not delay:
                continue
            row = _bound_row(rows[number], compiled, number, n, bound)
            for hit in found[: find_true(row, n, arena, found)].tolist():
                ids = compiled.decode_hit((number << CHOICE_BITS) + hit, memory.ids)[1]
                if all(memory.since.get(i, memory.now) <= now - delay for i in ids):
                    yield rule, ids


def _bound_row(row: Ints, compiled: CompiledRules, number: int, n: int, bound: int) -> Ints:
    """The position of one bound of `when` and of `unless`."""
    shifted = row.copy().reshape(1, -1)
    for column, place in zip((0, 2), compiled.condition_refs[number], strict=False):
        shifted[0, column] += bound * n ** len(place.axes)
    return shifted


def _unknown_arena(compiled: CompiledRules, n: int, size: int) -> Floats:
    """The arena for a sample in which all quantities are unknown."""
    arena, begin = np.empty(size), 0
    for lookup in compiled.quantities:
        cells = n**lookup.axes
        arena[begin : begin + cells] = -inf
        arena[begin + cells : begin + 2 * cells] = inf
        begin += 2 * cells
    return arena
