"""Evaluation of all rules on a mind, for all bindings of objects, in one run of one program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from visup.rules.formula.nodes import Rule
from visup.rules.formula.truth import MAYBE
from visup.rules.monitoring.compiler import ValueRef
from visup.rules.monitoring.intervals import Interval
from visup.rules.monitoring.linker import LinkedProgram
from visup.rules.monitoring.states import States
from visup.rules.monitoring.vm import Codes, Floats, Ints, find_true
from visup.rules.predicates.inputs_missing import inputs_missing
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.safety.compiled_rules import AlarmKey, CompiledRules


class Evaluation:
    """The values of all formulas at one step.

    Args:
        compiled: The rules.
        facts: The mind.
        now: Microseconds.
        before: States of the operators before the step, for the objects of `facts`.

    Attributes:
        after: States after the step.
    """

    def __init__(self, compiled: CompiledRules, facts: Snapshot, now: int, before: States) -> None:
        self.compiled: CompiledRules = compiled
        self.facts: Snapshot = facts
        self._layout: LinkedProgram = compiled.layout(len(facts.ids))
        self._arena: Floats = np.empty(self._layout.size)
        if compiled.quantities:
            np.concatenate(self._measured(), out=self._arena[: self._layout.lookup_size])
        self.after: States = self._layout.step(before, now, self._codes(), self._arena)

    def _codes(self) -> Codes:
        """All facts: the relations, then the others."""
        facts, layout, compiled = self.facts, self._layout, self.compiled
        codes_of_facts = [lookup.evaluate(facts).ravel() for lookup in compiled.facts]
        related = facts.relations(tuple(compiled.relations)).ravel()
        codes: Codes = np.concatenate([related, *codes_of_facts])
        if facts.mind.unknown:
            for step, node in compiled.program.lookups():
                if step in layout.facts and inputs_missing(facts.mind, node.name):
                    at = layout.facts[step]
                    codes[at : at + layout.n ** len(layout.axes[step])] = MAYBE
        return codes

    def _measured(self) -> list[Floats]:
        """The intervals of all quantities, in their order."""
        facts = self.facts
        intervals = [lookup.evaluate(facts) for lookup in self.compiled.quantities]
        if facts.mind.unknown:
            intervals = [
                facts.unknown(lookup.axes) if inputs_missing(facts.mind, lookup.name) else value
                for lookup, value in zip(self.compiled.quantities, intervals, strict=True)
            ]
        return [
            (value.swapaxes(1, 2) if lookup.transposed else value).ravel()
            for lookup, value in zip(self.compiled.quantities, intervals, strict=True)
        ]

    def interval(self, place: ValueRef, rows: tuple[int, ...]) -> Interval:
        """The interval of a formula for one binding of objects, given by their rows."""
        return self._layout.interval(place.step, rows, self._arena)

    def true_bindings(self) -> Iterator[tuple[Rule, tuple[int, ...]]]:
        """Every rule with every binding of objects for which it is true and not suspended."""
        return (self.compiled.decode_hit(hit, self.facts.ids) for hit in self.hits())

    def true_keys(self) -> Mapping[AlarmKey, int]:
        """For each rule and set of objects for which it is true, the first binding, encoded as in `found`."""
        return self.compiled.alarm_keys(self.facts.ids).of(self.hits())

    def hits(self) -> list[int]:
        """True bindings as numbers, by rule and binding; `CompiledRules.choice` decodes them."""
        rules, capacity = self.compiled.search_table(self._layout.n)
        found: Ints = np.empty(capacity, dtype=np.int64)
        count = find_true(rules, self._layout.n, self._arena, found)
        hits: list[int] = found[:count].tolist()
        return hits


def reindexed_states(
    compiled: CompiledRules, states: States, now: int, old: tuple[int, ...], new: tuple[int, ...]
) -> States:
    """Re-index the states of the operators for other objects.

    Args:
        compiled: The rules.
        states: States for the old objects.
        now: Microseconds of the sample at which they change.
        old: Their ids.
        new: Ids of the new ones; those not among the old have no past.

    Returns:
        The states for the new objects.
    """
    place = {object_id: i for i, object_id in enumerate(old)}
    rows = np.array([place.get(i, -1) for i in new], dtype=np.intp)
    known, wanted = compiled.layout(len(old)), compiled.layout(len(new))
    return known.memory.rerowed(states, wanted.memory, rows, now)
