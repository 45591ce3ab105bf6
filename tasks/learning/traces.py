"""A run as happenings: which actions held between whom, from when to when."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
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
"""An action and its actors, the actors of a pair in the order of the alphabet."""

OF_PAIRS = ("converging", "diverging", "touching", "coupled")
BREAK_S = 1.0
"""What ceases for less long goes on: relations flicker."""
SUSTAINED_S = 0.2
"""As fast as somebody moves for so long, it does move; an outline may jump."""
LEAST_S = {"converging": 0.6, "diverging": 0.6, "touching": 0.2, "coupled": 0.4, "decoupled": 0.2}
"""What lasts less long is noise."""


@dataclass(frozen=True, slots=True)
class Happening:
    """Something that held for a while.

    Attributes:
        symbol: What.
        begin: Seconds.
        end: Seconds.
        begun: Whether it was seen to begin, and was not so from the start; of contacts.
    """

    symbol: Symbol
    begin: float
    end: float
    begun: bool = True


@dataclass(frozen=True)
class RunTrace:
    """A run, as it is learned from.

    Attributes:
        name: Of the run, for messages.
        happenings: In the order of their begins.
        begin: Seconds of its first moment.
        end: Seconds of its last.
        minds: What was believed, moment by moment.
        always: Actors that were in the scene from their first sight to the end.
        moved_s: For how long each moved, seconds.
        moves: When each moved, from when to when, seconds.
        fastest: How fast each clearly moved at most, for `SUSTAINED_S`, px/s.
        diagonal: Of the image, pixels.
    """

    name: str
    happenings: tuple[Happening, ...]
    begin: float
    end: float
    minds: tuple[Mind, ...] = field(repr=False, default=())
    always: frozenset[str] = frozenset()
    moved_s: Mapping[str, float] = field(default_factory=dict)
    moves: Mapping[str, tuple[Span, ...]] = field(default_factory=dict)
    fastest: Mapping[str, float] = field(default_factory=dict)
    diagonal: float = 0.0


def trace_of(name: str, minds: Iterable[Mind]) -> RunTrace:
    """The happenings of a run.

    Args:
        name: Of the run.
        minds: What was believed, in the order of time.
    """
    kept = tuple(minds)
    spells: dict[Symbol, list[list[float]]] = {}
    always: set[Symbol] = set()
    gone: set[str] = set()
    named: set[str] = set()
    moved: dict[str, list[Span]] = {}
    speeds: dict[str, list[tuple[float, float]]] = {}
    before = kept[0].time if kept else 0.0
    for mind in kept:
        names = names_of(mind)
        for actor, speed, moves in _motions(mind, names):
            if moves:
                moved.setdefault(actor, []).append((before, mind.time))
            if speed is not None:
                speeds.setdefault(actor, []).append((mind.time, speed))
        before = mind.time
        named |= set(names.values())
        gone |= {n for i, n in names.items() if mind.objects[i].presence is Presence.LEFT}
        for symbol, truth in _held(mind, names):
            if symbol[0] == "touching" and truth is Truth.TRUE and symbol not in spells:
                always.add(symbol)
            if truth is not Truth.UNKNOWN:
                _note(spells.setdefault(symbol, []), truth, mind.time)
    begin, end = (kept[0].time, kept[-1].time) if kept else (0.0, 0.0)
    found = [h for s, rows in spells.items() for h in _happenings(s, rows, end, s not in always)]
    found += [p for h in found if (p := _parted(h, end)) is not None]
    return RunTrace(
        name,
        tuple(sorted(found, key=lambda h: (h.begin, h.symbol))),
        begin,
        end,
        kept,
        frozenset(named - gone),
        {actor: sum(b - a for a, b in spans) for actor, spans in moved.items()},
        {actor: _merged(spans) for actor, spans in moved.items()},
        {actor: _sustained(row) for actor, row in speeds.items()},
        image_diagonal(kept[0].frame_size) if kept else 0.0,
    )


def _motions(mind: Mind, names: dict[int, str]) -> Iterator[tuple[str, float | None, bool]]:
    """Of each object its speed, px/s, where it is seen, and whether that counts as moving.

    The speed is 0 where it does not clearly move: then the body rests, or is covered in part.
    """
    facts = Snapshot(mind)
    codes, clear, speeds = moving(facts), moving_clearly(facts), facts.one("speed")
    for number, row in facts.row.items():
        if number in names:
            seen = mind.objects[number].last_seen == mind.time and speeds[row] == speeds[row]
            speed = float(speeds[row]) if clear[row] == YES else 0.0
            yield names[number], speed if seen else None, codes[row] == YES


def _merged(spans: Sequence[Span]) -> tuple[Span, ...]:
    """Spans in order, with those that follow each other at once as one."""
    found: list[Span] = []
    for begin, end in spans:
        follows = bool(found) and begin <= found[-1][1]
        found.append((found.pop()[0] if follows else begin, end))
    return tuple(found)


def _sustained(speeds: Sequence[tuple[float, float]]) -> float:
    """The highest speed that was kept up for `SUSTAINED_S`, px/s, of times and speeds."""
    long, most, begin = SUSTAINED_S - 1e-9, 0.0, 0
    for end, (now, _) in enumerate(speeds):
        while begin < end and now - speeds[begin + 1][0] >= long:
            begin += 1
        if now - speeds[begin][0] >= long:
            most = max(most, min(speed for _, speed in speeds[begin : end + 1]))
    return most


def names_of(mind: Mind) -> dict[int, str]:
    """Objects by the actor that each plays or the model that it is believed to be, one for a name."""
    found: dict[str, int] = {}
    for number in sorted(mind.objects):
        name = believed_name(mind, number)
        if name is not None and mind.objects[number].confirmed:
            found.setdefault(name, number)
    return {i: n for n, i in found.items()}


def _held(mind: Mind, names: dict[int, str]) -> Iterator[tuple[Symbol, Truth]]:
    relations = RelationLookup(mind)
    ordered = sorted(names, key=names.__getitem__)
    for a, b in combinations(ordered, 2):
        for action in OF_PAIRS:
            yield (action, (names[a], names[b])), relations.find(action, (a, b)).truth


def _note(rows: list[list[float]], truth: Truth, now: float) -> None:
    """Rows of begin and end; one that goes on has no end yet."""
    going = bool(rows) and len(rows[-1]) == 1
    if truth is Truth.TRUE and not going:
        if rows and now - rows[-1][1] < BREAK_S:
            rows[-1].pop()
        else:
            rows.append([now])
    elif truth is Truth.FALSE and going:
        rows[-1].append(now)


def _happenings(
    symbol: Symbol, rows: list[list[float]], end: float, begun: bool
) -> Iterator[Happening]:
    """Of the rows of what is so, each that lasts; the first was so from the start unless it has begun."""
    for number, row in enumerate(rows):
        begin, until = row[0], row[1] if len(row) > 1 else end
        if until - begin >= LEAST_S[symbol[0]]:
            yield Happening(symbol, begin, until, begun or number > 0)


def _parted(coupling: Happening, end: float) -> Happening | None:
    """That a coupling came to its end."""
    if coupling.symbol[0] != "coupled" or end - coupling.end < LEAST_S["decoupled"]:
        return None
    return Happening(("decoupled", coupling.symbol[1]), coupling.end, end)
