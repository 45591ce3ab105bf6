"""What is foreseen at a sample beside what is told in the end, for comparing them."""

from __future__ import annotations

from itertools import pairwise
from random import Random

from tests.oracles.rule_formulas import SIGNALS, Interval, random_times, random_value
from visup.rules.formula.nodes import Formula
from visup.rules.formula.units import ticks
from visup.rules.monitoring.monitor import Monitor


def both_told(
    formula: Formula, rng: Random, longest_gap: int | None
) -> list[tuple[Interval, Interval]]:
    """Of each moment of which both speak: what was foreseen, and what was told in the end.

    Args:
        formula: Of signals.
        rng: Source of chance, for a history.
        longest_gap: Most time between two samples, microseconds; None for gaps of any length.
    """
    monitor = Monitor(formula, early=True)
    wait = ticks(monitor.delay) - ticks(monitor.early_delay)
    drawn, times = [ticks(t) for t in random_times(rng, 40)], [0]
    for before, after in pairwise(drawn):
        times.append(times[-1] + min(after - before, longest_gap or after))
    # The end tells of no moment between samples: half the samples have one just so much later.
    times = sorted({*times, *(t + wait for t in times if t + wait < times[-1])})
    foreseen, found = {}, []
    for t in times:
        told = monitor.step(t / 1e6, {name: random_value(rng) for name in SIGNALS})
        foreseen[t] = monitor.foreseen()
        if t - wait in foreseen:
            found.append((foreseen[t - wait], told))
    return found
