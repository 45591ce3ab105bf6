"""Rules over a mind: all of them, for all choices of objects, in one run of one program."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.rules.facts import Facts
from visup.rules.formula import Predicate, Rule
from visup.rules.inputs import blind
from visup.rules.intervals import Box
from visup.rules.operators import Pick
from visup.rules.program import Moment, Place
from visup.rules.ruled import FactKey, Ruled, asked
from visup.rules.terms import Measure

TRUTHS = np.array([[-np.inf, -np.inf, np.inf], [-np.inf, np.inf, np.inf]])
"""Intervals of what is false, unknown, true; by code + 1."""
States = tuple[Any, ...]


class Values:
    """The values of all formulas at one step.

    Args:
        prepared: The rules.
        facts: The mind.
        now: Microseconds.
        before: States of the operators before, for the objects of `facts`.
        known: Values of another step, such as the last one. What is the same now as it was there
            is not worked out again, whichever step it is.

    Attributes:
        after: States after.
    """

    def __init__(
        self, prepared: Ruled, facts: Facts, now: int, before: States, known: Values | None = None
    ) -> None:
        self.prepared: Ruled = prepared
        self.facts: Facts = facts
        self.axes = prepared.compiler.algebra.axes
        self._same: dict[tuple[int, int], NDArray[np.bool_]] = {}
        self._shapes: dict[tuple[int, ...], tuple[int, ...]] = {}
        self._codes: dict[FactKey, bytes | None] = {}
        if known is not None and (known.prepared, known.facts.ids) != (prepared, facts.ids):
            known = None
        self._before: Mapping[FactKey, Box] = known._found if known else {}
        self._found: dict[FactKey, Box] = self._truths(known)
        moment = Moment(now, before, self._look, self._same_object)
        self._values: list[Box] = prepared.program.step(moment, known._values if known else None)
        self._true = self._judged(known)
        self._before = {}  # values of one step do not keep those of all steps before alive
        self.after: States = tuple(moment.after)

    def _truths(self, known: Values | None) -> dict[FactKey, Box]:
        """All facts; there are dozens of them, of which few change in a step."""
        facts = self.facts
        facts.relate(self.prepared.relations)
        found = {}
        for fact in self.prepared.facts:
            codes = fact.codes(facts)
            told = None if blind(facts.mind, fact.name) else codes.tobytes()
            self._codes[fact.key] = told
            if known is not None and known._codes[fact.key] == told:
                found[fact.key] = known._found[fact.key]
                continue
            value = TRUTHS.take(codes + 1, axis=1)
            found[fact.key] = self._laid(
                _nothing_known(value) if told is None else value, fact.axes
            )
        return found

    def _look(self, node: Predicate | Measure, axes: tuple[int, ...]) -> Box:
        """A fact or quantity of all objects, laid along its axes."""
        found = self._found.get((id(node), axes))
        if found is not None:
            return found
        value: Box = asked(node)(self.facts)
        value = self._laid(
            _nothing_known(value) if blind(self.facts.mind, node.name) else value, axes
        )
        before = self._before.get((id(node), axes))
        if before is not None and value.tobytes() == before.tobytes():
            value = before  # what follows from it need not be worked out again
        self._found[id(node), axes] = value
        return value

    def _laid(self, value: Box, axes: tuple[int, ...]) -> Box:
        """(2, ...) values of one or two objects along the axes of these."""
        n = len(self.facts.ids)
        if len(axes) == 2 and axes[0] > axes[1]:
            value = value.reshape(2, n, n).swapaxes(1, 2)
        shape = self._shapes.get(axes)
        if shape is None:
            shape = (2, *(n if axis in axes else 1 for axis in range(self.axes)))
            self._shapes[axes] = shape
        return value.reshape(shape)

    def _same_object(self, one: int, other: int) -> NDArray[np.bool_]:
        """Whether two axes stand for one object."""
        key = (min(one, other), max(one, other))
        if key not in self._same:
            n = len(self.facts.ids)
            shape = [n if axis in key else 1 for axis in range(self.axes)]
            same = np.ones(n, bool) if one == other else np.eye(n, dtype=bool)
            self._same[key] = same.reshape(shape)
        return self._same[key]

    def at(self, place: Place) -> Box:
        """(2, ...) the interval of a formula for all choices of objects."""
        return self._values[place.step]

    def true(self) -> Iterator[tuple[Rule, tuple[int, ...]]]:
        """Every rule with every choice of objects for which it is true and not suspended."""
        for (rule, _, _), chosen in zip(self.prepared.verdicts, self._true, strict=True):
            for ids in chosen:
                yield rule, ids

    def _judged(self, known: Values | None) -> list[tuple[tuple[int, ...], ...]]:
        """For each rule the choices of objects for which it is true and not suspended."""
        values, found = self._values, []
        for k, (rule, places, apart) in enumerate(self.prepared.verdicts):
            if known is not None and all(values[p.step] is known._values[p.step] for p in places):
                found.append(known._true[k])
                continue
            holds = values[places[0].step][0] > 0
            if len(places) > 1:
                holds = holds & ~(values[places[1].step][0] > 0)
            # The quickest way to ask whether any of a few holds.
            choices = self._choices(rule, holds, apart) if np.count_nonzero(holds) else ()
            found.append(tuple(choices))
        return found

    def _choices(
        self, rule: Rule, holds: NDArray[np.bool_], apart: tuple[tuple[int, int], ...]
    ) -> Iterator[tuple[int, ...]]:
        count, ids = len(rule.variables), self.facts.ids
        if not count:
            yield ()
            return
        shape = (len(ids),) * count + (1,) * (self.axes - count)
        if holds.shape != shape:
            holds = np.broadcast_to(holds, shape)
        for rows in zip(*(axis.tolist() for axis in holds.nonzero()[:count]), strict=True):
            if all(rows[i] != rows[j] for i, j in apart):
                yield tuple([ids[row] for row in rows])


def _nothing_known(value: Box) -> Box:
    return np.stack([np.full(value.shape[1:], -np.inf), np.full(value.shape[1:], np.inf)])


def rerowed(
    prepared: Ruled, states: States, now: int, old: tuple[int, ...], new: tuple[int, ...]
) -> States:
    """The states of the operators for other objects.

    Args:
        prepared: The rules.
        states: States for the old objects.
        now: Microseconds of the sample at which they change.
        old: Their ids.
        new: Ids of the new ones; of those that are not among the old nothing is known yet.

    Returns:
        The states for the new objects.
    """
    place = {object_id: i for i, object_id in enumerate(old)}
    rows = np.array([place.get(i, -1) for i in new], dtype=np.intp)
    return tuple(
        state
        if state is None or not axes
        else operator.rows(state, now, _picker(axes, rows, len(old)))
        for state, (operator, axes) in zip(states, prepared.program.operators, strict=True)
    )


def _picker(axes: frozenset[int], rows: NDArray[np.intp], count: int) -> Pick:
    """Takes rows along every axis of an array that runs over objects."""
    fresh = rows < 0

    def pick(array: Any, fill: Any, lead: int = 1) -> Any:
        fill = np.reshape(fill, (2,) + (1,) * (array.ndim - 1)) if lead else fill
        for axis in axes:
            along = lead + axis
            if array.shape[along] != count:
                # One value for all objects so far, which need not be that of new ones.
                array = array.repeat(count, axis=along)
            if count:
                array = array.take(np.maximum(rows, 0), axis=along)
            else:
                shape = [*array.shape[:along], len(rows), *array.shape[along + 1 :]]
                array = np.empty(shape, array.dtype)
            at = (slice(None),) * along + (fresh,)
            array[at] = np.broadcast_to(fill, array.shape)[at]
        return array

    return pick
