"""Visits of objects: where each entered and left the picture, how long it was in view, what it came near."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

from visup.agent import Frame, Mind, ObjectBelief, Presence
from visup.agent.model.step import Step
from visup.narrative.colour_words import colour_word
from visup.narrative.places import Box, place_of, sides_of
from visup.percepts.colour import palette
from visup.rules.geometry.outlines import outline_gap
from visup.rules.wording.sentences import individual_name, spoken_name

MAX_ABSENCE_S = 1.5
"""A visit ends when its object has been out of view for this long, seconds; a later return starts another."""

MIN_GROWTH = 1.3
"""The colour is measured again when an object appears larger by this factor than when last measured."""

MAX_NEAR_GAP = 0.12
"""Objects farther apart than this, in image diagonals, do not count as near."""

MAX_PAIRS = 1000
"""Maximum number of pairs; those that were near each other for the shortest time are dropped."""

MAX_NEIGHBOURS = 12
"""Distances are measured between at most so many objects at a time, the largest ones."""


@dataclass(slots=True)
class ObjectVisit:
    """The visit of one object: from entering the view to leaving it.

    Attributes:
        id: The object.
        size: (width, height) of the picture, pixels.
        since: When it was first seen, seconds.
        until: When it was seen last, seconds.
        first: Its first box.
        last: Its last box.
        area: Its maximum visible area, pixels.
        name: Its individual name, or None.
        kind: Its class, if a detector gives no more than that, or None.
        colour: A word for its colour, or None.
        near: Id of each object that came near it -> minimum gap, pixels.
        left: Whether it left over the border.
        from_start: Whether it was in view in the first frames.
        at_end: Whether it was in view in the last frame.
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
    def entered_from(self) -> str | None:
        """The side over which it entered, or None if it was first seen within the picture."""
        sides = () if self.from_start else sides_of(self.first, self.size)
        return sides[0] if sides else None

    @property
    def left_to(self) -> str | None:
        """The side over which it left, or None."""
        sides = sides_of(self.last, self.size) if self.left else ()
        return sides[0] if sides else None

    @property
    def start_place(self) -> str:
        """The place where it was first seen."""
        return place_of(self.first, self.size)

    @property
    def end_place(self) -> str:
        """The place where it was last seen."""
        return place_of(self.last, self.size)

    @property
    def travelled(self) -> float:
        """The distance between the centres of its first and last box, image diagonals."""
        dx = self.last[0] + self.last[2] / 2 - self.first[0] - self.first[2] / 2
        dy = self.last[1] + self.last[3] / 2 - self.first[1] - self.first[3] / 2
        return float((dx * dx + dy * dy) ** 0.5) / diagonal(self.size)

    @property
    def closest(self) -> tuple[int, float] | None:
        """The object that came nearest, and the gap in pixels."""
        if not self.near:
            return None
        other = min(self.near, key=lambda i: (self.near[i], i))
        return other, self.near[other]


def diagonal(size: tuple[int, int]) -> float:
    """The diagonal of a picture, pixels."""
    return float((size[0] ** 2 + size[1] ** 2) ** 0.5)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where an unconfirmed object was first seen.

    Attributes:
        since: When, seconds.
        first: Its first box.
        until: When it was seen last.
    """

    since: float
    first: Box
    until: float


@dataclass(slots=True)
class VisitLog:
    """Records the visits of all objects of a run; call `add` with each step.

    Attributes:
        open_visits: Visits that have not ended, by object id.
        near_s: Pair of ids -> seconds in which both were near each other; the busiest ones.
        gaps: Pair of ids -> the least gap between their outlines, pixels.
        most_at_once: Maximum number of objects in view at a time.
        longest: The longest visit so far.
    """

    open_visits: dict[int, ObjectVisit] = field(default_factory=dict)
    near_s: dict[tuple[int, int], float] = field(default_factory=dict)
    gaps: dict[tuple[int, int], float] = field(default_factory=dict)
    most_at_once: int = 0
    longest: ObjectVisit | None = None
    _ids: set[int] = field(default_factory=set)
    _colours: dict[int, tuple[float, str | None]] = field(default_factory=dict)
    _reported_colours: dict[int, str | None] = field(default_factory=dict)
    _origins: dict[int, Origin] = field(default_factory=dict)
    _start: float | None = None
    _time: float = 0.0

    @property
    def count(self) -> int:
        """Number of objects so far; one that came back counts once."""
        return len(self._ids)

    def add(self, step: Step, frame: Frame | None) -> list[ObjectVisit]:
        """Add one step.

        Args:
            step: The step.
            frame: Its frame, for colours, or None.

        Returns:
            The visits that have ended since the last step, in order of their ends.
        """
        mind = step.mind
        elapsed = 0.0 if self._start is None else step.time - self._time
        self._start = step.time if self._start is None else self._start
        self._time = step.time
        visible = [
            b
            for _, b in sorted(mind.objects.items())
            if b.presence is Presence.SEEN and b.last_seen == step.time
        ]
        for belief in visible:
            self._measure_colour(belief, frame)
        self._note_unconfirmed(b for b in visible if not b.confirmed)
        confirmed = [b for b in visible if b.confirmed]
        for belief in confirmed:
            self._update_visit(belief, mind)
        self.most_at_once = max(self.most_at_once, len(confirmed))
        self._update_neighbours(confirmed, mind, elapsed)
        ended = list(self._ended_visits(mind))
        self._colours = {i: x for i, x in self._colours.items() if i in mind.objects}
        self._reported_colours = {
            i: x for i, x in self._reported_colours.items() if i in mind.objects
        }
        return ended

    def finish(self) -> list[ObjectVisit]:
        """The visits that have not ended when the run does."""
        open_at_end = [self.open_visits[i] for i in sorted(self.open_visits)]
        for visit in open_at_end:
            visit.at_end = visit.until == self._time
            self._close(visit)
        return open_at_end

    def _note_unconfirmed(self, candidates: Iterable[ObjectBelief]) -> None:
        """Store where unconfirmed objects were first seen."""
        for b in candidates:
            origin = self._origins.get(b.id, Origin(self._time, b.region.bbox, self._time))
            self._origins[b.id] = replace(origin, until=self._time)
        self._origins = {
            i: x for i, x in self._origins.items() if self._time - x.until <= MAX_ABSENCE_S
        }

    def _measure_colour(self, belief: ObjectBelief, frame: Frame | None) -> None:
        """Measure the colour of an object when it appears larger than before."""
        area, word = self._colours.get(belief.id, (0.0, None))
        if frame is not None and belief.region.area > MIN_GROWTH * area:
            word = colour_word(palette(frame.image, belief.region)) or word
            self._colours[belief.id] = belief.region.area, word

    def _update_visit(self, belief: ObjectBelief, mind: Mind) -> None:
        box, size = belief.region.bbox, mind.frame_size
        visit = self.open_visits.get(belief.id)
        if visit is None:
            # It was followed for some frames before it counted as an object.
            since = (
                self._time
                if belief.id in self._ids
                else max(belief.first_seen, self._time - MAX_ABSENCE_S)
            )
            origin = self._origins.pop(belief.id, Origin(since, box, since))
            in_first_frames = self._start is not None and origin.since - self._start < MAX_ABSENCE_S
            visit = ObjectVisit(
                belief.id,
                size,
                origin.since,
                self._time,
                origin.first,
                box,
                from_start=in_first_frames,
            )
            self.open_visits[belief.id] = visit
        visit.until, visit.last, visit.left = self._time, box, False
        visit.name = individual_name(mind, belief.id)
        visit.kind = spoken_name(mind, belief.id) if visit.name is None else None
        visit.area = max(visit.area, belief.region.area)
        colour = self._colours.get(belief.id, (0.0, None))[1]
        # Who was told of with one colour is not told of with another one.
        visit.colour = colour if self._reported_colours.get(belief.id, colour) == colour else None

    def _update_neighbours(
        self, visible: Sequence[ObjectBelief], mind: Mind, elapsed: float
    ) -> None:
        """Record which objects are near each other."""
        largest = sorted(visible, key=lambda b: (-b.region.area, b.id))[:MAX_NEIGHBOURS]
        near = MAX_NEAR_GAP * diagonal(mind.frame_size)
        for a, b in combinations(sorted(largest, key=lambda b: b.id), 2):
            gap = outline_gap(a.region, b.region, near)
            if gap is None:
                continue
            pair = a.id, b.id
            self.near_s[pair] = self.near_s.get(pair, 0.0) + elapsed
            self.gaps[pair] = min(gap, self.gaps.get(pair, gap))
            for object_id, other in (pair, pair[::-1]):
                gaps = self.open_visits[object_id].near
                gaps[other] = min(gap, gaps.get(other, gap))
        if len(self.near_s) > MAX_PAIRS:
            busiest = sorted(self.near_s, key=lambda p: (-self.near_s[p], p))[: MAX_PAIRS // 2]
            self.near_s = {p: self.near_s[p] for p in busiest}
            self.gaps = {p: self.gaps[p] for p in busiest}

    def _ended_visits(self, mind: Mind) -> Iterator[ObjectVisit]:
        for i in sorted(self.open_visits, key=lambda i: (self.open_visits[i].until, i)):
            visit = self.open_visits[i]
            belief = mind.objects.get(i)
            if belief is not None and belief.presence is Presence.LEFT:
                visit.left = True
            if self._time - visit.until > MAX_ABSENCE_S or belief is None:
                self._close(visit)
                yield visit

    def _close(self, visit: ObjectVisit) -> None:
        del self.open_visits[visit.id]
        self._reported_colours.setdefault(visit.id, visit.colour)
        self._ids.add(visit.id)
        if self.longest is None or visit.seconds > self.longest.seconds:
            self.longest = visit
