"""The linker: lays out a program's intervals and states for a number of objects.

Most operations are executed by `vm`. Window operators run one by one between its calls, on earlier results;
few calls are needed, since windows are rarely nested.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, cast

import numpy as np

from visup.rules.formula.nodes import Predicate
from visup.rules.formula.terms import Measure
from visup.rules.monitoring import vm
from visup.rules.monitoring.compiler import Operation, Program
from visup.rules.monitoring.intervals import (
    FALSE,
    TRUE,
    UNKNOWN,
    Arrays,
    Interval,
)
from visup.rules.monitoring.operators import (
    BooleanWindow,
    HysteresisLatch,
    PointOperator,
    SampleAndHold,
    Unbounded,
    ValueWhenTrue,
    WindowOperator,
)
from visup.rules.monitoring.samples import LONG_AGO, SAMPLE_HOLD
from visup.rules.monitoring.states import PointSlot, StateLayout, States, WindowSlot
from visup.rules.monitoring.vm import Codes, Floats, bits

_ON = Arrays()
_KINDS = {
    "not": vm.NOT,
    "abs": vm.ABS,
    "least": vm.LEAST,
    "most": vm.MOST,
    "above": vm.SHIFT,
    "below": vm.BELOW,
    "compare": vm.COMPARE,
    "+": vm.PLUS,
    "-": vm.MINUS,
    "*": vm.TIMES,
    "/": vm.OVER,
    "rate": vm.RATE,
    "sqrt": vm.ROOT,
    "exp": vm.EXP,
    "power": vm.POWER,
    "exists": vm.SOME,
    "forall": vm.EVERY,
    "number": vm.NUMBER,
}


class _Stage(NamedTuple):
    """One stage, which depends on earlier ones: instructions and constants, then windows."""

    rows: list[list[int]]
    numbers: list[tuple[float, float]]
    windows: list[int]


class LinkedProgram:
    """A program laid out for a number of objects.

    Args:
        program: The steps.
        n: Number of objects.
        facts: Start of each fact's codes, by the step that looks it up.
        codes: Number of fact codes.

    Attributes:
        places: Start of each step's intervals.
        axes: Axes of the objects that each step depends on, in order.
        size: Length of the arena, numbers.
        lookup_size: Length of its first part, the lookup_size-up quantities, in their order.
        memory: Layout of the states.
        fresh: The states before the first sample.
    """

    def __init__(self, program: Program, n: int, facts: Mapping[int, int], codes: int) -> None:
        self.program, self.n, self.facts, self.codes = program, n, facts, codes
        self.places: list[int] = []
        self.axes = [tuple(sorted(step.axes)) for step in program.steps]
        self.size = 0
        self._stages: list[_Stage] = []
        self._available_from: list[int] = []  # the stage from which each step's value is available
        self._broadcasts: dict[tuple[int, frozenset[int]], int] = {}
        self._point_slots: list[PointSlot] = []
        self._windows: list[WindowSlot] = []
        self._state_size = 0
        # Quantities come first, so that they are copied in one go.
        measured = [k for k, node in program.lookups() if isinstance(node, Measure)]
        places = {k: self._allocate(n ** len(self.axes[k])) for k in measured}
        self.lookup_size = self.size
        for number, step in enumerate(program.steps):
            room = places.get(number)
            self.places.append(self._allocate(n ** len(step.axes)) if room is None else room)
            self._lay_out(number, step)
        self.memory = StateLayout(n, tuple(self._point_slots), tuple(self._windows))
        self.fresh = self.memory.fresh()
        rows = [row for stage in self._stages for row in stage.rows]
        numbers = [pair for stage in self._stages for pair in stage.numbers]
        self._code = np.array(rows, dtype=np.int64).reshape(-1, vm.WIDTH)
        self._numbers = np.array(numbers, dtype=np.float64).reshape(-1, 2)
        self._ends = np.cumsum([len(stage.rows) for stage in self._stages]).tolist()

    def step(self, states: States, now: int, facts: Codes, arena: Floats) -> States:
        """Process one sample.

        Args:
            states: States before, for the same number of objects.
            now: Microseconds.
            facts: Codes of the lookup_size-up facts.
            arena: (size,) all intervals; those of the lookup_size-up quantities are filled in.

        Returns:
            States after; the arena holds the intervals of all steps.
        """
        then, before = states.then, states.moments
        if then is not None and now - then > SAMPLE_HOLD:
            before = self.memory.silenced(before, then + SAMPLE_HOLD)
        code, numbers, n, moment = self._code, self._numbers, self.n, float(now)
        after = np.empty_like(before) if before.size else before
        windows, begin = list(states.windows), 0
        changed = before is not states.moments
        for end, stage in zip(self._ends, self._stages, strict=True):
            if begin < end and vm.run(
                code, numbers, begin, end, n, moment, facts, arena, before, after
            ):
                changed = True
            begin = end
            for slot in stage.windows:
                windows[slot] = self._windows[slot].update(windows[slot], now, arena)
        return States(now, after if changed else states.moments, tuple(windows))

    def interval(self, step: int, rows: tuple[int, ...], arena: Floats) -> Interval:
        """The interval of a step for one binding of objects, given by rows along all axes."""
        axes, at = self.axes[step], 0
        for axis in axes:
            at = at * self.n + rows[axis]
        at += self.places[step]
        return arena.item(at), arena.item(at + self.n ** len(axes))

    def _lay_out(self, number: int, step: Operation) -> None:
        """Lay out a step."""
        cells = self.n ** len(step.axes)
        stage = max((self._available_from[r] for r in step.reads), default=0)
        if isinstance(step.operator, WindowOperator):
            self._stage(stage).windows.append(len(self._windows))
            reads = tuple(self._broadcast(r, step.axes) for r in step.reads)
            self._windows.append(
                WindowSlot(
                    step.operator,
                    step.operator.on(_ON),
                    len(step.axes),
                    reads,
                    self.places[number],
                    cells,
                )
            )
            stage += 1
        elif step.node is None or isinstance(step.node, Predicate):
            self._append(stage, *self._row(number, step, cells))
        self._available_from.append(stage)

    def _row(
        self, number: int, step: Operation, cells: int
    ) -> tuple[list[int], tuple[float, float]]:
        """The virtual machine's instruction for a step."""
        row, numbers = [0] * vm.WIDTH, (*step.numbers, 0.0, 0.0)
        row[vm.DEST], row[vm.CELLS] = self.places[number], cells
        row[vm.MASK] = bits(step.axes)
        if step.node is not None:
            row[vm.OP], row[vm.A] = vm.FACT, self.facts[number]
            row[vm.AXIS] = int(len(step.order) == 2 and step.order[0] > step.order[1])
        elif step.kind in ("exists", "forall"):
            (read,) = step.reads
            row[vm.OP], row[vm.A] = _KINDS[step.kind], self.places[read]
            row[vm.MASK_A] = bits(self.program.steps[read].axes)
            row[vm.AXIS], row[vm.APART] = step.order[0], bits(step.order[1:])
        else:
            for column, read in zip((vm.A, vm.B), step.reads, strict=False):
                row[column] = self._broadcast(read, step.axes)
            if step.operator is None:
                row[vm.OP] = _KINDS[step.kind]
            else:
                operator = cast("PointOperator", step.operator)
                row[vm.OP], span, fills = _opcode(operator)
                row[vm.STATE], numbers = self._state_size, (span, 0.0)
                self._point_slots.append(
                    PointSlot(operator, len(step.axes), self._state_size, fills)
                )
                self._state_size += cells * len(fills)
        return row, (numbers[0], numbers[1])

    def _broadcast(self, read: int, axes: frozenset[int]) -> int:
        """Position of a step's intervals, broadcast to some axes."""
        own = self.program.steps[read].axes
        if own == axes:
            return self.places[read]
        if (read, axes) not in self._broadcasts:
            cells = self.n ** len(axes)
            row = [0] * vm.WIDTH
            row[vm.OP], row[vm.A] = vm.SPREAD, self.places[read]
            row[vm.DEST], row[vm.CELLS] = self._allocate(cells), cells
            row[vm.MASK_A], row[vm.MASK] = bits(own), bits(axes)
            self._append(self._available_from[read], row, (0.0, 0.0))
            self._broadcasts[read, axes] = row[vm.DEST]
        return self._broadcasts[read, axes]

    def _allocate(self, cells: int) -> int:
        self.size += 2 * cells
        return self.size - 2 * cells

    def _stage(self, stage: int) -> _Stage:
        while len(self._stages) <= stage:
            self._stages.append(_Stage([], [], []))
        return self._stages[stage]

    def _append(self, stage: int, row: list[int], numbers: tuple[float, float]) -> None:
        rows, pairs, _ = self._stage(stage)
        rows.append(row)
        pairs.append(numbers)


def _opcode(operator: PointOperator) -> tuple[int, float, tuple[float, ...]]:
    """Opcode of an operator, its span, and its state before the first sample."""
    match operator:
        case BooleanWindow(kind=kind, high=high):
            # The value before the first sample is unknown.
            op = vm.LASTS if kind == "always" else vm.HAPPENED
            return op, float(high), (np.inf, -np.inf)
        case Unbounded(kind=kind):
            ops = {"always": vm.ALWAYS, "once": vm.ONCE, "since": vm.SINCE}
            return ops[kind], 0.0, TRUE if kind == "always" else FALSE
        case HysteresisLatch():
            return vm.LATCH, 0.0, (0.0,)
        case ValueWhenTrue():
            return vm.NOTE, 0.0, UNKNOWN
        case SampleAndHold(age=age):
            return vm.RECALL, float(age), (*UNKNOWN, float(LONG_AGO))
