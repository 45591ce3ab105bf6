"""What rules can speak of: relations, facts and quantities, read off a mind; unknown stays unknown."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from math import inf, isnan, nan
from types import MappingProxyType

from visup.agent import HealthStatus, Mind, ObjectBelief, Presence, Relation, Truth
from visup.rules.geometry import RCC8
from visup.rules.measure import Measured, RelationSettings, scale
from visup.rules.relations import measured
from visup.rules.sentences import believed_name
from visup.rules.tracks import at_border, tracks

RELATION_NAMES = (
    "converging",
    "diverging",
    "keeping_distance",
    "touching",
    "coupled",
    "moving_together",
    *RCC8,
)
"""Relations between two objects; all but the proper parts are symmetric."""

IMPLIED = MappingProxyType(
    {
        "converging": frozenset({"converging", "touching", "coupled"}),
        "touching": frozenset({"touching", "coupled"}),
        "keeping_distance": frozenset({"keeping_distance", "moving_together", "coupled"}),
        "moving_together": frozenset({"moving_together", "coupled"}),
    }
)
"""Relation -> expectations that make it fine: whoever shall be coupled must converge and touch."""


class Facts:
    """One mind as rules see it; made once for each step.

    Args:
        mind: The mind after relations were judged.
    """

    def __init__(self, mind: Mind) -> None:
        self.mind = mind
        self.objects: dict[int, ObjectBelief] = {b.id: b for b in mind.present()}

    @cached_property
    def measured(self) -> Measured:
        """Quantities of all pairs."""
        return measured(self.mind)

    def relation(self, name: str, a: int, b: int) -> Relation | None:
        """A relation between two objects, or None when it was not judged."""
        return self.mind.relation(name, a, b)

    def time_to_contact(self, a: int, b: int) -> float:
        """Seconds until two outlines meet if they go on so; infinite when they do not close in."""
        return self.measured.pair("time_to_contact", a, b)

    @cached_property
    def first_contacts(self) -> dict[int, tuple[float, int]]:
        """Object -> the least time to contact with any other one, and that one."""
        first: dict[int, tuple[float, int]] = {}
        ids = sorted(self.objects)
        for a in ids:
            times = [(t, b) for b in ids if b != a and not isnan(t := self.time_to_contact(a, b))]
            if times:
                first[a] = min(times)
        return first

    def depth_difference(self, a: int, b: int) -> float:
        """Difference of depth as a share of the smaller one; NaN when either is unknown."""
        near, far = sorted((self.measured.one("depth", a), self.measured.one("depth", b)))
        return (far - near) / near if near > 0 else nan


def truth(value: bool) -> Truth:
    """True or false as a `Truth`."""
    return Truth.TRUE if value else Truth.FALSE


def related(facts: Facts, name: str, a: int, b: int) -> Truth:
    """Whether a relation holds; the box relations in the order of their objects."""
    found = facts.relation(name, a, b)
    return Truth.UNKNOWN if found is None else found.truth


def expected(facts: Facts, name: str, *ids: int) -> Truth:
    """Whether an active task expects a relation between these objects now."""
    fine = IMPLIED.get(name, frozenset({name}))
    wanted = (e for task in facts.mind.tasks for e in task.expected)
    return truth(any(e.relation in fine and set(e.objects) == set(ids) for e in wanted))


def unexpected(facts: Facts, a: int) -> Truth:
    """Whether no active task explains an object; without a task nothing is unexpected."""
    tasks = facts.mind.tasks
    return truth(bool(tasks) and all(a in task.unexplained for task in tasks))


def is_actor(facts: Facts, a: int) -> Truth:
    """Whether an object plays an actor of an active task."""
    return truth(any(b.object_id == a for task in facts.mind.tasks for b in task.bindings))


def is_named(facts: Facts, a: int, name: str) -> Truth:
    """Whether an object is believed to be that model or actor; unknown while not identified."""
    belief = facts.objects.get(a)
    if belief is None or not belief.candidates:
        return Truth.UNKNOWN
    return truth(name in (belief.name, believed_name(facts.mind, a)))


def moving(facts: Facts, a: int) -> Truth:
    """Whether an object moves in the image."""
    speed = facts.measured.one("speed", a)
    if isnan(speed):
        return Truth.UNKNOWN
    return truth(speed > RelationSettings().still_speed * scale(facts.mind.frame_size))


def whole(facts: Facts, a: int) -> Truth:
    """Whether an object is clear of the image border."""
    belief = facts.objects.get(a)
    if belief is None:
        return Truth.UNKNOWN
    return truth(not at_border(belief.region, facts.mind.frame_size, 0))


def first_contact(facts: Facts, a: int, b: int) -> Truth:
    """Whether b is what a would meet first."""
    if isnan(facts.time_to_contact(a, b)):
        return Truth.UNKNOWN
    return truth(facts.first_contacts.get(a, (inf, -1))[1] == b)


def stale(facts: Facts, kind: str) -> Truth:
    """Whether percepts of a kind could not be observed in this step."""
    return truth(kind in facts.mind.unknown)


def presence(facts: Facts, a: int, wanted: Presence) -> Truth:
    """Whether an object is seen, or hidden."""
    belief = facts.objects.get(a)
    return Truth.UNKNOWN if belief is None else truth(belief.presence is wanted)


def lost(facts: Facts, a: int) -> Truth:
    """Whether an object is out of sight and nothing tells why."""
    track = tracks(facts.mind).of.get(a)
    return truth(track is not None and track.told == "lost")


@dataclass(frozen=True, slots=True)
class Word:
    """A word of the rule language that stands for something true, false or unknown.

    Attributes:
        takes: What its arguments are: 'object', 'relation', 'kind' or 'name'.
        look: Its meaning; objects come as ids, other arguments as words.
        meaning: One clause for people.
    """

    takes: tuple[str, ...]
    look: Callable[..., Truth]
    meaning: str


@dataclass(frozen=True, slots=True)
class Quantity:
    """A word of the rule language that stands for a number.

    Attributes:
        takes: What its arguments are.
        dimension: 'time', 'length', 'speed', 'share', ...
        look: Its value in the base unit; NaN when unknown.
        meaning: One clause for people.
    """

    takes: tuple[str, ...]
    dimension: str
    look: Callable[..., float]
    meaning: str


def _relation_word(name: str) -> Word:
    def look(facts: Facts, a: int, b: int) -> Truth:
        return related(facts, name, a, b)

    return Word(("object", "object"), look, f"{name.replace('_', ' ')}, a relation")


_ONE, _TWO = ("object",), ("object", "object")

WORDS: MappingProxyType[str, Word] = MappingProxyType(
    {
        **{name: _relation_word(name) for name in RELATION_NAMES},
        "expected": Word(
            ("relation", "object", "object"), expected, "an active task expects the relation"
        ),
        "unexpected": Word(_ONE, unexpected, "no active task explains the object"),
        "actor": Word(_ONE, is_actor, "the object plays an actor of an active task"),
        "named": Word(("object", "name"), is_named, "the object is believed to be that"),
        "seen": Word(_ONE, lambda f, a: presence(f, a, Presence.SEEN), "the object is seen"),
        "hidden": Word(_ONE, lambda f, a: presence(f, a, Presence.HIDDEN), "it is out of sight"),
        "lost": Word(_ONE, lost, "it is out of sight and nothing tells why"),
        "moving": Word(_ONE, moving, "it moves in the image"),
        "whole": Word(_ONE, whole, "it is clear of the image border"),
        "first_contact": Word(_TWO, first_contact, "the second is what the first would meet first"),
        "stale": Word(("kind",), stale, "percepts of that kind could not be observed"),
        "healthy": Word(
            (), lambda f: truth(f.mind.health.status is HealthStatus.OK), "the image is sound"
        ),
    }
)
"""Every relation and fact that a rule may name."""

QUANTITIES: MappingProxyType[str, Quantity] = MappingProxyType(
    {
        "time_to_contact": Quantity(
            _TWO, "time", lambda f, a, b: f.time_to_contact(a, b), "until the outlines meet"
        ),
        "gap": Quantity(
            _TWO, "length", lambda f, a, b: f.measured.pair("gap", a, b), "between the outlines"
        ),
        "closing_speed": Quantity(
            _TWO, "speed", lambda f, a, b: -f.measured.pair("rate", a, b), "of the distance"
        ),
        "relative_speed": Quantity(
            _TWO, "speed", lambda f, a, b: f.measured.pair("relative_speed", a, b), "in the image"
        ),
        "speed": Quantity(_ONE, "speed", lambda f, a: f.measured.one("speed", a), "in the image"),
        "depth_difference": Quantity(
            _TWO, "share", lambda f, a, b: f.depth_difference(a, b), "of the smaller depth"
        ),
        "out_of_sight": Quantity(
            _ONE, "time", lambda f, a: f.mind.time - f.objects[a].last_seen, "since last seen"
        ),
        "in_view": Quantity(
            _ONE, "time", lambda f, a: f.mind.time - f.objects[a].first_seen, "since first seen"
        ),
    }
)
"""Every quantity that a rule may compare."""

KINDS = ("region", "hypothesis", "depth", "health")


def all_true(values: Iterable[Truth]) -> Truth:
    """Kleene's strong conjunction: false if any is false, else unknown if any is unknown."""
    result = Truth.TRUE
    for value in values:
        if value is Truth.FALSE:
            return Truth.FALSE
        if value is Truth.UNKNOWN:
            result = Truth.UNKNOWN
    return result


def any_true(values: Iterable[Truth]) -> Truth:
    """Kleene's strong disjunction: true if any is true, else unknown if any is unknown."""
    result = Truth.FALSE
    for value in values:
        if value is Truth.TRUE:
            return Truth.TRUE
        if value is Truth.UNKNOWN:
            result = Truth.UNKNOWN
    return result


def negated(value: Truth) -> Truth:
    """Kleene's negation: unknown stays unknown."""
    if value is Truth.UNKNOWN:
        return value
    return Truth.FALSE if value is Truth.TRUE else Truth.TRUE
