"""The lives of objects: where each came from and went, how long it was in view, what it came near."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

from visup.agent import Frame, Mind, ObjectBelief, Presence
from visup.agent.model.step import Step
from visup.percepts.colour import palette
from visup.rules.geometry.outlines import outline_gap
from visup.rules.wording.sentences import individual_name, spoken_name
from visup.story.colour_words import colour_word
from visup.story.places import Box, place_of, sides_of

OVER_S = 1.5
"""A life ends when its object has been out of view for this long; a later return starts another."""

GROWN = 1.3
"""The colour is measured again when an object appears larger by this factor than when last measured."""

NEAR = 0.12
"""Objects farther apart than this, in image diagonals, do not count as near."""

MOST_PAIRS = 1000
"""Most pairs to keep; those that were near each other for the shortest time are forgotten."""

MOST_NEIGHBOURS = 12
"""Most objects at once between which nearness is recorded, the largest first."""


@dataclass(slots=True)
class ObjectLife:
    """One object from its coming into view to its going.

    Attributes:
        id: Of the object.
        size: (width, height) of the picture, pixels.
        since: When it was first seen, seconds.
        until: When it was seen last, seconds.
        first: Its box then.
        last: Its box when it was seen last.
        area: Pixels it showed at the most.
        name: What it alone is called, or None.
        kind: What kind of thing it is, where a detector tells that and no more, or None.
        colour: A word for its colour, or None.
        near: Object id -> least gap in pixels, of those that came near it.
        left: Whether it went over the border.
        from_start: Whether it was in view in the first frames.
        at_end: Whether it was in view in the last one.
    """

    id: int
    size: tuple[int, int]
    since: float
    until: float
    first: Box
    last: Box
    area: float = 0.0
    name: str | None = None
    kind: str | None = None
    colour: str | None = None
    near: dict[int, float] = field(default_factory=dict)
    left: bool = False
    from_start: bool = False
    at_end: bool = False

    @property
    def seconds(self) -> float:
        """How long it was in view."""
        return self.until - self.since

    @property
    def came_from(self) -> str | None:
        """The side over which it came, or None when it was first seen within the picture."""
        sides = () if self.from_start else sides_of(self.first, self.size)
        return sides[0] if sides else None

    @property
    def went_to(self) -> str | None:
        """The side over which it went, or None."""
        sides = sides_of(self.last, self.size) if self.left else ()
        return sides[0] if sides else None

    @property
    def begun_at(self) -> str:
        """The place where it was first seen."""
        return place_of(self.first, self.size)

    @property
    def ended_at(self) -> str:
        """The place where it was seen last."""
        return place_of(self.last, self.size)

    @property
    def travelled(self) -> float:
        """How far its middle has come, image diagonals."""
        dx = self.last[0] + self.last[2] / 2 - self.first[0] - self.first[2] / 2
        dy = self.last[1] + self.last[3] / 2 - self.first[1] - self.first[3] / 2
        return float((dx * dx + dy * dy) ** 0.5) / diagonal(self.size)

    @property
    def closest(self) -> tuple[int, float] | None:
        """The object that came nearest, and its gap in pixels."""
        if not self.near:
            return None
        other = min(self.near, key=lambda i: (self.near[i], i))
        return other, self.near[other]


def diagonal(size: tuple[int, int]) -> float:
    """Of a picture, pixels."""
    return float((size[0] ** 2 + size[1] ** 2) ** 0.5)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where something that may be an object was first seen.

    Attributes:
        since: When, seconds.
        first: Its box then.
        until: When it was seen last.
    """

    since: float
    first: Box
    until: float


@dataclass(slots=True)
class LifeLog:
    """Follows all objects of a run; give it each step.

    Attributes:
        alive: Lives that are not over, by object id.
        together: Pair of ids -> seconds in which both were near each other; the busiest ones.
        gaps: Pair of ids -> the least gap between their outlines, pixels.
        most_at_once: The most objects in view at one time.
        longest: The longest life so far.
    """

    alive: dict[int, ObjectLife] = field(default_factory=dict)
    together: dict[tuple[int, int], float] = field(default_factory=dict)
    gaps: dict[tuple[int, int], float] = field(default_factory=dict)
    most_at_once: int = 0
    longest: ObjectLife | None = None
    _ids: set[int] = field(default_factory=set)
    _looked: dict[int, tuple[float, str | None]] = field(default_factory=dict)
    _told: dict[int, str | None] = field(default_factory=dict)
    _origins: dict[int, Origin] = field(default_factory=dict)
    _begun: float | None = None
    _now: float = 0.0

    @property
    def count(self) -> int:
        """Number of objects so far; one that came back counts once."""
        return len(self._ids)

    def add(self, step: Step, frame: Frame | None) -> list[ObjectLife]:
        """Take in one step.

        Args:
            step: The step.
            frame: Its frame, or None where there is none: colours are then not known.

        Returns:
            The lives that are over since the last step, in the order in which they ended.
        """
        mind = step.mind
        lasted = 0.0 if self._begun is None else step.time - self._now
        self._begun = step.time if self._begun is None else self._begun
        self._now = step.time
        shown = [
            b
            for _, b in sorted(mind.objects.items())
            if b.presence is Presence.SEEN and b.last_seen == step.time
        ]
        for belief in shown:
            self._look(belief, frame)
        self._await(b for b in shown if not b.confirmed)
        seen = [b for b in shown if b.confirmed]
        for belief in seen:
            self._see(belief, mind)
        self.most_at_once = max(self.most_at_once, len(seen))
        self._meet(seen, mind, lasted)
        over = list(self._over(mind))
        self._looked = {i: x for i, x in self._looked.items() if i in mind.objects}
        self._told = {i: x for i, x in self._told.items() if i in mind.objects}
        return over

    def finish(self) -> list[ObjectLife]:
        """The lives that are not over when the run is."""
        rest = [self.alive[i] for i in sorted(self.alive)]
        for life in rest:
            life.at_end = life.until == self._now
            self._close(life)
        return rest

    def _await(self, candidates: Iterable[ObjectBelief]) -> None:
        """Remember where those were first seen that are not yet sure to be objects."""
        for b in candidates:
            known = self._origins.get(b.id, Origin(self._now, b.region.bbox, self._now))
            self._origins[b.id] = replace(known, until=self._now)
        self._origins = {i: x for i, x in self._origins.items() if self._now - x.until <= OVER_S}

    def _look(self, belief: ObjectBelief, frame: Frame | None) -> None:
        """What colour it has, where it shows best so far."""
        area, word = self._looked.get(belief.id, (0.0, None))
        if frame is not None and belief.region.area > GROWN * area:
            word = colour_word(palette(frame.image, belief.region)) or word
            self._looked[belief.id] = belief.region.area, word

    def _see(self, belief: ObjectBelief, mind: Mind) -> None:
        box, size = belief.region.bbox, mind.frame_size
        life = self.alive.get(belief.id)
        if life is None:
            # It was followed for some frames before it counted as an object.
            since = (
                self._now if belief.id in self._ids else max(belief.first_seen, self._now - OVER_S)
            )
            origin = self._origins.pop(belief.id, Origin(since, box, since))
            start = self._begun is not None and origin.since - self._begun < OVER_S
            life = ObjectLife(
                belief.id, size, origin.since, self._now, origin.first, box, from_start=start
            )
            self.alive[belief.id] = life
        life.until, life.last, life.left = self._now, box, False
        life.name = individual_name(mind, belief.id)
        life.kind = spoken_name(mind, belief.id) if life.name is None else None
        life.area = max(life.area, belief.region.area)
        colour = self._looked.get(belief.id, (0.0, None))[1]
        # Who was told of with one colour is not told of with another one.
        life.colour = colour if self._told.get(belief.id, colour) == colour else None

    def _meet(self, seen: Sequence[ObjectBelief], mind: Mind, lasted: float) -> None:
        """Record which objects are near each other."""
        largest = sorted(seen, key=lambda b: (-b.region.area, b.id))[:MOST_NEIGHBOURS]
        near = NEAR * diagonal(mind.frame_size)
        for a, b in combinations(sorted(largest, key=lambda b: b.id), 2):
            gap = outline_gap(a.region, b.region, near)
            if gap is None:
                continue
            pair = a.id, b.id
            self.together[pair] = self.together.get(pair, 0.0) + lasted
            self.gaps[pair] = min(gap, self.gaps.get(pair, gap))
            for one, other in (pair, pair[::-1]):
                known = self.alive[one].near
                known[other] = min(gap, known.get(other, gap))
        if len(self.together) > MOST_PAIRS:
            busiest = sorted(self.together, key=lambda p: (-self.together[p], p))[: MOST_PAIRS // 2]
            self.together = {p: self.together[p] for p in busiest}
            self.gaps = {p: self.gaps[p] for p in busiest}

    def _over(self, mind: Mind) -> Iterator[ObjectLife]:
        for i in sorted(self.alive, key=lambda i: (self.alive[i].until, i)):
            life = self.alive[i]
            belief = mind.objects.get(i)
            if belief is not None and belief.presence is Presence.LEFT:
                life.left = True
            if self._now - life.until > OVER_S or belief is None:
                self._close(life)
                yield life

    def _close(self, life: ObjectLife) -> None:
        del self.alive[life.id]
        self._told.setdefault(life.id, life.colour)
        self._ids.add(life.id)
        if self.longest is None or life.seconds > self.longest.seconds:
            self.longest = life
