"""Fragments: new regions that may only be parts of a known body.

Motion segmentation sometimes splits a body in two: a shadow falls along an arm, a face of a spinning
satellite moves unlike the rest. A region that first appears at, or within the outline of, something larger is
therefore a suspected fragment until it has been clearly apart from that body for a while. Motion alone does
not clear it: a sliver along an edge appears to slide on it (the aperture problem), and its outline wanders.
The price: of two bodies of unequal size that touch from the start, the smaller one is not reported before
they separate.

A region that came over the image border was never a part of a body inside and is not suspected, even when it
soon passes in front of one; at the start of a video nothing has come over the border yet. Of two new regions
that touch, the larger one is the body; if their sizes are similar, neither is a part of the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.geometry.outlines import outline_gap, prepared_outline
from visup.rules.geometry.regions import DIRECTIONS, box_intersection, expanded, image_diagonal
from visup.rules.presence.object_tracks import ObjectTrack, border_sides, predicted_box


@dataclass(frozen=True, slots=True)
class FragmentSettings:
    """When a region counts as a possible part of another one, and until when.

    Attributes:
        part: Largest part, as a share of the body's area.
        touch: Outline gap up to which a region touches a body, image diagonals.
        apart: Outline gap beyond which it is clearly apart, image diagonals.
        apart_size: The same as a share of the square root of the region's area; the greater one counts.
        within: Share of a region's outline inside a body's convex hull, or of its box inside the predicted
            box of the body, from which it is within the body.
        apart_s: How long it must be apart to be an object of its own, seconds.
    """

    part: float = 0.7
    touch: float = 0.006
    apart: float = 0.012
    apart_size: float = 0.25
    within: float = 0.5
    apart_s: float = 0.5


@dataclass(frozen=True, slots=True)
class FragmentHypothesis:
    """Whether a tentative region may be a part of a body.

    Attributes:
        body: Id of that object, or None without one.
        rejected: Whether it has proved to be an object of its own, which is final.
        apart_since: Seconds since when it is clearly apart from the body, or None.
    """

    body: int | None = None
    rejected: bool = False
    apart_since: float | None = None

    @property
    def holds(self) -> bool:
        """Whether the region may be a part of a body now."""
        return self.body is not None and not self.rejected


FRAGMENTS: MemoryKey[Mapping[int, FragmentHypothesis]] = MemoryKey(
    "rules.fragments", MappingProxyType({})
)


@dataclass(frozen=True, slots=True)
class FragmentTest:
    """Tests which new regions may be fragments, from step to step."""

    settings: FragmentSettings = FragmentSettings()

    def __call__(
        self,
        before: Mapping[int, FragmentHypothesis],
        mind: Mind,
        of: Mapping[int, ObjectTrack],
        *,
        starting: bool,
    ) -> dict[int, FragmentHypothesis]:
        """Run one step.

        Args:
            before: Hypotheses of the previous step, by object id.
            mind: The mind; its tentative objects are tested.
            of: Tracks by object id.
            starting: Whether the video has just begun.

        Returns:
            A hypothesis for each tentative object; those out of view keep theirs.
        """
        bodies = [b for b in mind.objects.values() if b.presence is not Presence.LEFT]
        fragments = {}
        for new in mind.objects.values():
            if new.confirmed:
                continue
            fragment = before.get(new.id)
            if new.last_seen == mind.time:
                larger = [b for b in bodies if self._may_contain(b, new, of)]
                if fragment is None:
                    fragment = self._first(new, larger, mind, starting=starting)
                fragment = (
                    fragment if fragment.rejected else self._again(fragment, new, larger, mind, of)
                )
            if fragment is not None:
                fragments[new.id] = fragment
        return fragments

    def _first(
        self, new: ObjectBelief, bodies: Iterable[ObjectBelief], mind: Mind, *, starting: bool
    ) -> FragmentHypothesis:
        """The first hypothesis about a region.

        A region that came over the border is not suspected, unless it touches a body at the same border.
        """
        sides = border_sides(new.region, mind.frame_size)
        if starting or not sides:
            return FragmentHypothesis()
        there = [b for b in bodies if sides & border_sides(b.region, mind.frame_size)]
        return FragmentHypothesis(rejected=self._body_of(new.region, there, mind) is None)

    def _again(
        self,
        fragment: FragmentHypothesis,
        new: ObjectBelief,
        bodies: Iterable[ObjectBelief],
        mind: Mind,
        of: Mapping[int, ObjectTrack],
    ) -> FragmentHypothesis:
        """The hypothesis about a region updated by one step."""
        body = self._body_of(new.region, bodies, mind)
        body = body or mind.objects.get(-1 if fragment.body is None else fragment.body)
        if body is None or body.presence is Presence.LEFT:
            return FragmentHypothesis()
        if body.id != fragment.body:
            fragment = FragmentHypothesis(body.id)
        apart = self._gap(new.region, body.region, mind) is None and not self._in_place(
            new.region, of.get(body.id), mind
        )
        since = (
            (mind.time if fragment.apart_since is None else fragment.apart_since) if apart else None
        )
        parted = since is not None and mind.time - since >= self.settings.apart_s - 1e-6
        return replace(fragment, apart_since=since, rejected=parted)

    def _in_place(self, region: Region, body: ObjectTrack | None, mind: Mind) -> bool:
        """Whether a region is mostly inside the predicted box of a body, which may be hardly visible."""
        if body is None:
            return False
        x, y, w, h = region.bbox
        inside = box_intersection(predicted_box(body, mind.time), (x, y, w, h))
        return inside >= self.settings.within * w * h

    def _may_contain(
        self, body: ObjectBelief, new: ObjectBelief, of: Mapping[int, ObjectTrack]
    ) -> bool:
        """Whether an object may be the body of a new one: it was seen no earlier, and is larger."""
        if body.id == new.id or body.id not in of or body.last_seen < new.first_seen:
            return False
        # A body that has lost a part is compared by its former area.
        whole = max(body.region.area, of[body.id].reference_area if body.confirmed else 0.0)
        return new.region.area <= self.settings.part * whole

    def _gap(self, region: Region, body: Region, mind: Mind) -> float | None:
        """Outline gap, pixels, or None when the two are clearly apart."""
        s = self.settings
        far = max(s.apart * image_diagonal(mind.frame_size), s.apart_size * region.area**0.5)
        return outline_gap(region, body, far)

    def _body_of(
        self, region: Region, bodies: Iterable[ObjectBelief], mind: Mind
    ) -> ObjectBelief | None:
        """The nearest body that the region touches or is within."""
        near: list[tuple[float, int, ObjectBelief]] = []
        for body in bodies:
            gap = self._gap(region, body.region, mind)
            if gap is None:
                continue
            touches = gap <= self.settings.touch * image_diagonal(mind.frame_size)
            if touches or share_within(region, body.region) >= self.settings.within:
                near.append((gap, body.id, body))
        return min(near)[2] if near else None


def share_within(region: Region, body: Region) -> float:
    """Share of a region's outline inside the convex hull of another, 0 to 1.

    The hull is approximated by its tangents in `DIRECTIONS`, at most 2 % too wide.
    """
    points = prepared_outline(region).points @ DIRECTIONS.T
    limit = (prepared_outline(body).points @ DIRECTIONS.T).max(axis=0)
    return float((points <= limit + 1.0).all(axis=1).mean())


def in_place_of_hidden(new: ObjectBelief, mind: Mind, of: Mapping[int, ObjectTrack]) -> bool:
    """Whether a region is mostly inside the predicted box of a known, at least partly hidden object."""
    for old in mind.objects.values():
        track = of.get(old.id)
        if not old.confirmed or old.presence is Presence.LEFT or track is None:
            continue
        if old.presence is Presence.SEEN and track.visible_share > 0.7:
            continue
        place = expanded(predicted_box(track, mind.time), 6)
        x, y, w, h = new.region.bbox
        if box_intersection(place, (x, y, w, h)) > 0.6 * max(1, w * h):
            return True
    return False
