"""Prefilters the runs of a lake for a condition, by the recorded intervals of relations.

The *possible times* of a formula are intervals that include every moment at which it is true, for each
assignment of objects, and perhaps others. A relation is possible where it was recorded as true; `and` where
all its parts are; a window shifts and widens the interval of its part. A formula without recorded relations
(a quantity, a `not`) is always possible. Runs without possible times are skipped; the others are evaluated
exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

from visup.archive.querying.views import quoted
from visup.rules.formula.nodes import (
    And,
    Formula,
    FutureOperator,
    Last,
    MOfN,
    Or,
    PastOperator,
    Predicate,
    Previous,
    Quantified,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.units import TICKS
from visup.rules.monitoring.samples import SAMPLE_HOLD
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.rules.relations.reasoner import COLUMNS

MAX_GAP_S = SAMPLE_HOLD / TICKS + 0.1
"""Seconds by which intervals are widened: the hold time of a sample, and rounding."""
FOREVER = 1e12
_HOLDING_SQL = (
    'held AS MATERIALIZED (SELECT number AS run, relation, a, b, "begin", "end" FROM lake_index.held'
    " WHERE relation IN ({names}){known})"
)
"""Intervals of the relations that a formula names, in runs with an object for every name; materialised once.
Runs are numbers."""
SYMMETRIC = frozenset(
    name for column in COLUMNS.each if column.rows[0] == column.rows[1] for name in column.names
) | {"coupled"}
"""Relations with one row per unordered pair."""


@dataclass(frozen=True, slots=True)
class PossibleTimes:
    """Intervals in which a formula may be true, as a SELECT.

    Attributes:
        sql: Yields `run`, the variables, `low` and `high` (seconds) from the rows of `_HOLDING_SQL`.
        variables: Its variables.
        relations: Its relations.
    """

    sql: str
    variables: tuple[str, ...]
    relations: tuple[str, ...]

    def shifted(self, low: float, high: float) -> PossibleTimes:
        """The times from `low` to `high` seconds after these."""
        names = "".join(f"{_name(v)}, " for v in self.variables)
        sql = f"SELECT run, {names}low + {low!r} AS low, high + {high!r} AS high FROM ({self.sql})"
        return PossibleTimes(sql, self.variables, self.relations)

    def of(self, variables: Sequence[str]) -> PossibleTimes:
        """The projection on fewer variables."""
        retained = tuple(v for v in self.variables if v in variables)
        names = "".join(f"{_name(v)}, " for v in retained)
        return PossibleTimes(
            f"SELECT DISTINCT run, {names}low, high FROM ({self.sql})", retained, self.relations
        )

    def for_name(self, variable: str, who: str) -> PossibleTimes:
        """The times restricted to some objects for a variable.

        Args:
            variable: One of the variables, or another.
            who: A SELECT of `run` and `object`.
        """
        if variable not in self.variables:
            return self
        same = f"w.run = t.run AND w.object = t.{_name(variable)}"
        return PossibleTimes(
            f"SELECT t.* FROM ({self.sql}) t SEMI JOIN ({who}) w ON {same}",
            self.variables,
            self.relations,
        )


def possible_times(formula: Formula) -> PossibleTimes | None:
    """When a formula may be true; None for always."""
    match formula:
        case Predicate(name=name, arguments=(a, b)) if name in RELATION_NAMES and a != b:
            return _relation(name, a, b)
        case And(parts=parts):
            found = [p for p in map(possible_times, parts) if p is not None]
            return reduce(_intersection, found) if found else None
        case Or(parts=parts):
            return _union([possible_times(p) for p in parts])
        case Quantified(kind="exists", variable=variable, part=part):
            inner = possible_times(part)
            others = [v for v in inner.variables if v != variable] if inner else []
            return inner and inner.of(others)
        case Previous(part=part):
            return _shifted(part, 0.0, MAX_GAP_S)
        case Last(part=part, duration=duration):
            return _shifted(part, 0.0, duration.base)
        case MOfN(part=part, of=of) if not formula.counts_samples and formula.least.value > 0:
            return _shifted(part, 0.0, of.base)
    return _windowed(formula)


def _windowed(formula: Formula) -> PossibleTimes | None:
    match formula:
        case PastOperator(kind="once", part=part, window=window):
            return _shifted(part, *_span(window))
        case PastOperator(kind="always", part=part, window=window) if _includes_now(window):
            return possible_times(part)
        case Since(right=right, window=window):
            return _shifted(right, *_span(window))
        case FutureOperator(kind="eventually", part=part, window=TimeWindow(high=high)):
            return _shifted(part, 0.0, high.base)
        case Until(right=right, window=TimeWindow(high=high)):
            return _shifted(right, 0.0, high.base)
    return None


def _shifted(part: Formula, low: float, high: float) -> PossibleTimes | None:
    found = possible_times(part)
    return found and found.shifted(low, high)


def _span(window: TimeWindow | None) -> tuple[float, float]:
    return (0.0, FOREVER) if window is None else (window.low.base, window.high.base)


def _includes_now(window: TimeWindow | None) -> bool:
    """Whether a window includes the present."""
    return window is None or window.low.base == 0


def _relation(name: str, a: str, b: str) -> PossibleTimes:
    low, high = f'"begin" - {MAX_GAP_S!r}', f'"end" + {MAX_GAP_S!r}'
    if name == "coupled":  # also evaluated for hidden objects, for which no relation is recorded
        low, high = repr(-FOREVER), repr(FOREVER)
    rows = f"FROM held WHERE relation = {quoted(name)}"
    sql = f"SELECT run, a AS {_name(a)}, b AS {_name(b)}, {low} AS low, {high} AS high {rows}"
    if name in SYMMETRIC:
        turned = (
            f"SELECT run, b AS {_name(a)}, a AS {_name(b)}, {low} AS low, {high} AS high {rows}"
        )
        sql = f"{sql} UNION ALL {turned}"
    return PossibleTimes(sql, (a, b), (name,))


def _intersection(one: PossibleTimes, other: PossibleTimes) -> PossibleTimes:
    shared = [v for v in other.variables if v in one.variables]
    more = [v for v in other.variables if v not in one.variables]
    names = [f"l.{_name(v)}" for v in one.variables] + [f"r.{_name(v)}" for v in more]
    same = "".join(f" AND l.{_name(v)} = r.{_name(v)}" for v in shared)
    sql = (
        f"SELECT l.run, {', '.join(names)}{', ' if names else ''}"
        "greatest(l.low, r.low) AS low, least(l.high, r.high) AS high"
        f" FROM ({one.sql}) l JOIN ({other.sql}) r"
        f" ON l.run = r.run{same} AND l.low <= r.high AND r.low <= l.high"
    )
    return PossibleTimes(sql, (*one.variables, *more), (*one.relations, *other.relations))


def _union(parts: Sequence[PossibleTimes | None]) -> PossibleTimes | None:
    known = [p for p in parts if p is not None]
    if len(known) < len(parts):
        return None
    shared = [v for v in known[0].variables if all(v in p.variables for p in known)]
    names = "".join(f"{_name(v)}, " for v in shared)
    each = (f"SELECT run, {names}low, high FROM ({p.sql})" for p in known)
    relations = tuple(r for p in known for r in p.relations)
    return PossibleTimes(" UNION ALL ".join(each), tuple(shared), relations)


def _name(variable: str) -> str:
    return f'"of_{variable}"'
