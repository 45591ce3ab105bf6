"""Which new regions may be no objects of their own but parts of a body that is already known.

A camera that sees motion now and then cuts a body in two: a shadow falls along an arm, a face of a
spinning satellite moves unlike the rest of it. What first shows itself at, or within the outline
of, something larger is therefore doubted. A doubt ends when the region
- has been clearly apart from that body for a while, or
- moves unlike it for longer: both outlines move as one each, their velocities differ steadily over
  the last second, and so the distance of their hulls changes.
What came over the image border was never a part of a body inside and is not doubted, even where it
passes before one soon after; at the start of a video nothing has come over the border yet. Of two
regions that touch when both are new, the larger one is the body; where they are much of a size,
neither is a part of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from visup.agent import Mind, ObjectBelief, Presence, Region
from visup.rules.fit import theil_sen, velocity
from visup.rules.geometry import (
    DIRECTIONS,
    Reach,
    box_overlap,
    grow,
    hull_separation,
    outline,
    outline_gap,
    reach,
)
from visup.rules.measure import scale
from visup.rules.tracks import Track, border_sides, expected_box

FRAGMENTS = "rules.fragments"


@dataclass(frozen=True, slots=True)
class FragmentSettings:
    """When a region counts as a possible part of another one, and when no longer.

    Attributes:
        part: Share of the body's area up to which a region may be a part of it.
        touch: Outline gap up to which a region touches a body, image diagonals.
        apart: Outline gap beyond which it is clearly apart, image diagonals.
        apart_size: The same as a share of the root of its area; the greater one counts.
        within: Share of its outline inside a body's convex hull by which it is within the body.
        apart_s: How long it must be apart.
        motion_s: How long it must move unlike the body.
        motion: Relative speed that counts as such, image diagonals per second.
        sigmas: How many standard deviations of its slope the trend of the distance must exceed.
        misfit: How unevenly an outline may move and still have a velocity, image diagonals/s.
    """

    part: float = 0.7
    touch: float = 0.006
    apart: float = 0.012
    apart_size: float = 0.25
    within: float = 0.5
    apart_s: float = 0.5
    motion_s: float = 1.0
    motion: float = 0.005
    sigmas: float = 4.0
    misfit: float = 0.0075


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """How far a region and the body that it may be a part of reached at one time, in seconds."""

    time: float
    region: Reach
    body: Reach


@dataclass(frozen=True, slots=True, eq=False)
class Doubt:
    """Whether a region that is not confirmed yet may be a part of a body.

    Attributes:
        body: Id of that object, or None while there is none.
        over: Whether it has shown to be an object of its own; that is not doubted again.
        apart_since: Seconds since when it is clearly apart from the body, or None.
        samples: Of the last `motion_s`.
    """

    body: int | None = None
    over: bool = False
    apart_since: float | None = None
    samples: tuple[Sample, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether the region may be a part of a body now."""
        return self.body is not None and not self.over


@dataclass(frozen=True, slots=True)
class Doubting:
    """Keeps the doubts about regions from step to step."""

    settings: FragmentSettings = FragmentSettings()

    def __call__(
        self,
        before: Mapping[int, Doubt],
        mind: Mind,
        of: Mapping[int, Track],
        *,
        starting: bool,
    ) -> dict[int, Doubt]:
        """Judge one step.

        Args:
            before: Doubts of the step before, by object id.
            mind: The mind; its unconfirmed objects are judged.
            of: Tracks by object id.
            starting: Whether the video has only begun.

        Returns:
            A doubt for each unconfirmed object; those out of sight keep theirs.
        """
        bodies = [b for b in mind.objects.values() if b.presence is not Presence.LEFT]
        doubts = {}
        for new in mind.objects.values():
            if new.confirmed:
                continue
            doubt = before.get(new.id)
            if new.last_seen == mind.time:
                larger = [b for b in bodies if self._may_contain(b, new, of)]
                if doubt is None:
                    doubt = self._first(new, larger, mind, starting=starting)
                doubt = doubt if doubt.over else self._again(doubt, new, larger, mind)
            if doubt is not None:
                doubts[new.id] = doubt
        return doubts

    def _first(
        self, new: ObjectBelief, bodies: Iterable[ObjectBelief], mind: Mind, *, starting: bool
    ) -> Doubt:
        """What came over the border is not doubted, unless a body at that side reaches to it."""
        sides = border_sides(new.region, mind.frame_size)
        if starting or not sides:
            return Doubt()
        there = [b for b in bodies if sides & border_sides(b.region, mind.frame_size)]
        return Doubt(over=self._body_of(new.region, there, mind) is None)

    def _again(
        self, doubt: Doubt, new: ObjectBelief, bodies: Iterable[ObjectBelief], mind: Mind
    ) -> Doubt:
        body = self._body_of(new.region, bodies, mind)
        body = body or mind.objects.get(-1 if doubt.body is None else doubt.body)
        if body is None or body.presence is Presence.LEFT:
            return Doubt()
        if body.id != doubt.body:
            doubt = Doubt(body.id)
        doubt = self._with_sample(doubt, new, body, mind)
        apart = self._gap(new.region, body.region, mind) is None
        since = (mind.time if doubt.apart_since is None else doubt.apart_since) if apart else None
        parted = since is not None and mind.time - since >= self.settings.apart_s - 1e-6
        over = parted or self._moves_away(doubt.samples, mind)
        return replace(doubt, apart_since=since, over=over, samples=() if over else doubt.samples)

    def _may_contain(self, body: ObjectBelief, new: ObjectBelief, of: Mapping[int, Track]) -> bool:
        """Whether a belief may be the body of a new one: another one in sight, and larger."""
        if body.id == new.id or body.id not in of or body.last_seen < new.first_seen:
            return False
        # A body that has lost a part is judged by what it was.
        whole = max(body.region.area, of[body.id].reference if body.confirmed else 0.0)
        return new.region.area <= self.settings.part * whole

    def _gap(self, region: Region, body: Region, mind: Mind) -> float | None:
        """Outline gap, pixels, or None when the two are clearly apart."""
        s = self.settings
        far = max(s.apart * scale(mind.frame_size), s.apart_size * region.area**0.5)
        return outline_gap(region, body, far)

    def _body_of(
        self, region: Region, bodies: Iterable[ObjectBelief], mind: Mind
    ) -> ObjectBelief | None:
        """The nearest body that the region touches, or within whose outline it is."""
        near: list[tuple[float, int, ObjectBelief]] = []
        for body in bodies:
            gap = self._gap(region, body.region, mind)
            if gap is None:
                continue
            touches = gap <= self.settings.touch * scale(mind.frame_size)
            if touches or share_within(region, body.region) >= self.settings.within:
                near.append((gap, body.id, body))
        return min(near)[2] if near else None

    def _with_sample(
        self, doubt: Doubt, new: ObjectBelief, body: ObjectBelief, mind: Mind
    ) -> Doubt:
        if body.last_seen < mind.time:
            return doubt
        reaches = (reach(b.region, mind.frame_size) for b in (new, body))
        oldest = mind.time - self.settings.motion_s - 1e-6
        kept = tuple(s for s in doubt.samples if s.time >= oldest)
        return replace(doubt, samples=(*kept, Sample(mind.time, *reaches)))

    def _moves_away(self, samples: tuple[Sample, ...], mind: Mind) -> bool:
        """Whether the two have moved unlike each other for all of the time."""
        s, diagonal = self.settings, scale(mind.frame_size)
        if len(samples) < 8 or samples[-1].time - samples[0].time < 0.85 * s.motion_s:
            return False
        times = np.array([x.time for x in samples])
        support = np.array([[x.region.support, x.body.support] for x in samples])
        free = np.array([[x.region.free, x.body.free] for x in samples])
        half = len(times) // 2
        early, late = (
            np.subtract(*velocity(times[part], support[part], free[part], s.misfit * diagonal))
            for part in (slice(None, half), slice(half, None))
        )
        least = s.motion * diagonal
        speed = np.linalg.norm(early + late) / 2
        # A segment that changes its shape seems to move too, but unsteadily. An unknown velocity
        # (NaN) fails both comparisons and so is no proof.
        if not (speed > least and np.linalg.norm(late - early) < speed):
            return False
        distance = np.array([hull_separation(both)[0, 1] for both in support])
        slope, sigma = theil_sen(times, distance[:, None])
        return bool(abs(slope[0]) > max(least, s.sigmas * sigma[0]))


def share_within(region: Region, body: Region) -> float:
    """Share of a region's outline that lies within the convex hull of another, 0 to 1.

    The hull is taken as the polygon of its tangents in `DIRECTIONS`, at most 2 % too wide.
    """
    points = outline(region) @ DIRECTIONS.T
    limit = (outline(body) @ DIRECTIONS.T).max(axis=0)
    return float((points <= limit + 1.0).all(axis=1).mean())


def in_place_of_hidden(new: ObjectBelief, mind: Mind, of: Mapping[int, Track]) -> bool:
    """Whether a region stands where a known object should be that is hidden, in part at least."""
    for old in mind.objects.values():
        track = of.get(old.id)
        if not old.confirmed or old.presence is Presence.LEFT or track is None:
            continue
        if old.presence is Presence.SEEN and track.visible > 0.7:
            continue
        place = grow(expected_box(track, mind.time), 6)
        x, y, w, h = new.region.bbox
        if box_overlap(place, (x, y, w, h)) > 0.6 * max(1, w * h):
            return True
    return False
