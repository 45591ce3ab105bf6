"""A run as intervals: which actions held between which actors, and when."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from visup.agent import Mind, Presence, Truth
from visup.rules.formula.truth import YES
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.motion import moving, moving_clearly
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.wording.sentences import believed_name
from visup.tasks.verification.observe import RelationLookup

Span = tuple[float, float]
Symbol = tuple[str, tuple[str, ...]]
"""An action and its actors, those of a pair in alphabetical order."""

PAIR_ACTIONS = ("converging", "diverging", "touching", "coupled")
LONGEST_BRIDGED_GAP_S = 1.0
"""Shorter gaps, seconds, are bridged: relations flicker."""
SUSTAINED_S = 0.2
"""A speed counts when it is sustained for this long, seconds; an outline may jump."""
MIN_S = {"converging": 0.6, "diverging": 0.6, "touching": 0.2, "coupled": 0.4, "decoupled": 0.2}
"""Shorter intervals, seconds, are noise."""


@dataclass(frozen=True, slots=True)
class ActionInterval:
    """An interval in which an action held.

    Attributes:
        symbol: The action and its actors.
        begin: Seconds.
        end: Seconds.
        begin_observed: Whether its beginning was observed; False for contacts present from the start.
    """

    symbol: Symbol
    begin: float
    end: float
    begin_observed: bool = True


@dataclass(frozen=True)
class RunTrace:
    """A run as input of learning.

    Attributes:
        name: Of the run, for messages.
        intervals: Sorted by begin.
        begin: Time of its first step, seconds.
        end: Time of its last step, seconds.
        minds: The mental model at each step.
        always: Actors that stayed in the scene from first detection to the end.
        moved_s: Total time of motion of each actor, seconds.
        moves: Intervals of motion of each actor, seconds.
        fastest: Greatest speed of clear motion of each actor, sustained for `SUSTAINED_S`, px/s.
        diagonal: Of the image, pixels.
    """

    name: str
    intervals: tuple[ActionInterval, ...]
    begin: float
    end: float
    minds: tuple[Mind, ...] = field(repr=False, default=())
    always: frozenset[str] = frozenset()
    moved_s: Mapping[str, float] = field(default_factory=dict)
    moves: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
    fastest: Mapping[str, float] = field(default_factory=dict)
    diagonal: float = 0.0


def trace_of(name: str, minds: Iterable[Mind]) -> RunTrace:
    """The trace of a run.

    Args:
        name: Of the run.
        minds: The mental model at each step, in chronological order.
    """
    history = tuple(minds)
    rows_of: dict[Symbol, list[list[float]]] = {}
    from_start: set[Symbol] = set()
    left: set[str] = set()
    names_seen: set[str] = set()
    motion_spans: dict[str, list[Span]] = {}
    speeds: dict[str, list[tuple[float, float]]] = {}
    previous_time = history[0].time if history else 0.0
    for mind in history:
        names = names_of(mind)
        for actor, speed, moves in _motion_of_objects(mind, names):
            if moves:
                motion_spans.setdefault(actor, []).append((previous_time, mind.time))
            if speed is not None:
                speeds.setdefault(actor, []).append((mind.time, speed))
        previous_time = mind.time
        names_seen |= set(names.values())
        left |= {n for i, n in names.items() if mind.objects[i].presence is Presence.LEFT}
        for symbol, truth in _relations(mind, names):
            if symbol[0] == "touching" and truth is Truth.TRUE and symbol not in rows_of:
                from_start.add(symbol)
            if truth is not Truth.UNKNOWN:
                _extend_rows(rows_of.setdefault(symbol, []), truth, mind.time)
    begin, end = (history[0].time, history[-1].time) if history else (0.0, 0.0)
    return RunTrace(
        name,
        _sorted_intervals(rows_of, from_start, end),
        begin,
        end,
        history,
        frozenset(names_seen - left),
        {actor: sum(b - a for a, b in spans) for actor, spans in motion_spans.items()},
        {actor: _merged(spans) for actor, spans in motion_spans.items()},
        {actor: _sustained_speed(row) for actor, row in speeds.items()},
        image_diagonal(history[0].frame_size) if history else 0.0,
    )


def _sorted_intervals(
    rows_of: Mapping[Symbol, list[list[float]]], from_start: Container[Symbol], end: float
) -> tuple[ActionInterval, ...]:
    """The intervals of all symbols by their begin, with those of decoupling."""
    found: list[ActionInterval] = []
    for symbol, rows in rows_of.items():
        found += _intervals(symbol, rows, end, symbol not in from_start)
    found += [p for i in found if (p := _decoupling(i, end)) is not None]
    return tuple(sorted(found, key=lambda i: (i.begin, i.symbol)))


def _motion_of_objects(
    mind: Mind, names: dict[int, str]
) -> Iterator[tuple[str, float | None, bool]]:
    """Name, speed in px/s (None if not visible) and whether it is moving, of each object.

    The speed is 0 without clear motion: then the body rests or is partly occluded.
    """
    facts = Snapshot(mind)
    codes, clear, speeds = moving(facts), moving_clearly(facts), facts.one("speed")
    for number, row in facts.row.items():
        if number in names:
            seen = mind.objects[number].last_seen == mind.time and speeds[row] == speeds[row]
            speed = float(speeds[row]) if clear[row] == YES else 0.0
            yield names[number], speed if seen else None, codes[row] == YES


def _merged(spans: Sequence[Span]) -> tuple[Span, ...]:
    """Spans in order, adjacent ones merged."""
    found: list[Span] = []
    for begin, end in spans:
        follows = bool(found) and begin <= found[-1][1]
        found.append((found.pop()[0] if follows else begin, end))
    return tuple(found)


def _sustained_speed(speeds: Sequence[tuple[float, float]]) -> float:
    """The highest speed sustained for `SUSTAINED_S`, px/s, from (time, speed) samples."""
    shortest, highest, begin = SUSTAINED_S - 1e-9, 0.0, 0
    for end, (time, _) in enumerate(speeds):
        while begin < end and time - speeds[begin + 1][0] >= shortest:
            begin += 1
        if time - speeds[begin][0] >= shortest:
            highest = max(highest, min(speed for _, speed in speeds[begin : end + 1]))
    return highest


def names_of(mind: Mind) -> dict[int, str]:
    """The name (actor or believed model) of each confirmed object, one object per name."""
    found: dict[str, int] = {}
    for number in sorted(mind.objects):
        name = believed_name(mind, number)
        if name is not None and mind.objects[number].confirmed:
            found.setdefault(name, number)
    return {i: n for n, i in found.items()}


def _relations(mind: Mind, names: dict[int, str]) -> Iterator[tuple[Symbol, Truth]]:
    relations = RelationLookup(mind)
    ordered = sorted(names, key=names.__getitem__)
    for a, b in combinations(ordered, 2):
        for action in PAIR_ACTIONS:
            yield (action, (names[a], names[b])), relations.find(action, (a, b)).truth


def _extend_rows(rows: list[list[float]], truth: Truth, now: float) -> None:
    """Update [begin, end] rows; an open interval has no end yet."""
    is_open = bool(rows) and len(rows[-1]) == 1
    if truth is Truth.TRUE and not is_open:
        if rows and now - rows[-1][1] < LONGEST_BRIDGED_GAP_S:
            rows[-1].pop()
        else:
            rows.append([now])
    elif truth is Truth.FALSE and is_open:
        rows[-1].append(now)


def _intervals(
    symbol: Symbol, rows: list[list[float]], end: float, begun: bool
) -> Iterator[ActionInterval]:
    """The intervals of a symbol that are long enough.

    `begun` says whether the beginning of the first was observed; that of later ones always was.
    """
    for number, row in enumerate(rows):
        begin, until = row[0], row[1] if len(row) > 1 else end
        if until - begin >= MIN_S[symbol[0]]:
            yield ActionInterval(symbol, begin, until, begun or number > 0)


def _decoupling(coupling: ActionInterval, end: float) -> ActionInterval | None:
    """The end of a coupling as an interval of its own."""
    if coupling.symbol[0] != "coupled" or end - coupling.end < MIN_S["decoupled"]:
        return None
    return ActionInterval(("decoupled", coupling.symbol[1]), coupling.end, end)
