"""One step of presence reasoning in the making, and its settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from visup.agent import Event, Mind, ObjectBelief, Observation, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.outlines import NEAR_SHARE, outline_gap
from visup.rules.geometry.regions import box_gap, image_diagonal
from visup.rules.presence.fragments import FragmentHypothesis
from visup.rules.presence.object_tracks import ObjectTrack
from visup.rules.wording.sentences import sentence


@dataclass(frozen=True, slots=True)
class PresenceSettings:
    """How long things must last before they are told, and how much must show.

    Attributes:
        entry_s: A region that came over the border, or was there at the start, enters after this.
        entry_inside_s: The same for one that appears in the middle of the image.
        start_s: Length of the start, in which every region may be new.
        least_sightings: Sightings that an entry needs.
        allowed_gap_s: Longest flicker within a steady sighting.
        settle_s: How long an object must be missing before exit or occlusion is told.
        missed_s: The same when it is not seen though another hides only a part of it.
        lost_s: The same when nothing explains it.
        partial_s: How long little must show before exit or occlusion is told.
        hidden_share: Below this share in sight, beside another region, an object is occluded.
        leaving_share: Below this share, going over the border, it has left.
        shown_share: Above this share a hidden object has reappeared.
        shown_s: How long it must show, or stay in the clear, before that is told.
        whole_share: An object of which less shows was being hidden, and went up in no other.
        contact_px: Regions closer than this may hide parts of each other.
        adopt_s: A new region must be seen this long before it can be a hidden object.
        least_share: Share of the image below which nobody enters who has not been recognised.
    """

    entry_s: float = 0.36
    entry_inside_s: float = 1.0
    start_s: float = 2.0
    least_sightings: int = 3
    allowed_gap_s: float = 0.25
    settle_s: float = 0.3
    missed_s: float = 0.9
    lost_s: float = 2.0
    partial_s: float = 0.16
    hidden_share: float = 0.2
    leaving_share: float = 0.12
    shown_share: float = 0.5
    shown_s: float = 0.12
    whole_share: float = 0.6
    contact_px: float = 4.0
    adopt_s: float = 0.12
    least_share: float = 0.0005


@dataclass(slots=True)
class StepContext:
    """One step in the making; lives only while the reasoner runs."""

    mind: Mind
    observation: Observation
    of: dict[int, ObjectTrack]
    doubts: Mapping[int, FragmentHypothesis]
    settings: PresenceSettings
    events: list[Event] = field(default_factory=list)
    _sorted: tuple[Mapping[int, ObjectBelief], list[ObjectBelief]] | None = None

    @property
    def now(self) -> float:
        """Seconds."""
        return self.observation.time

    def objects(self) -> list[ObjectBelief]:
        """All objects, by id."""
        if self._sorted is None or self._sorted[0] is not self.mind.objects:
            of = self.mind.objects
            self._sorted = of, [of[i] for i in sorted(of)]
        return self._sorted[1]

    def seen(self) -> list[ObjectBelief]:
        """Objects with a region now, confirmed or not, by id."""
        now = self.now
        return [b for b in self.objects() if b.last_seen == now]

    def missing(self) -> list[ObjectBelief]:
        """Confirmed objects without a region of their own now, unless they left."""
        now, left = self.now, Presence.LEFT
        return [
            b
            for b in self.objects()
            if b.last_seen < now and b.confirmed and b.presence is not left
        ]

    def doubted(self, new: ObjectBelief, body: ObjectBelief | None = None) -> bool:
        """Whether a region may be only a part: of one body, or of any."""
        doubt = self.doubts.get(new.id)
        return doubt is not None and doubt.holds and (body is None or doubt.body == body.id)

    def put(self, belief: ObjectBelief, **track: object) -> None:
        """Believe it, and change what its track says."""
        self.mind = self.mind.with_objects(belief)
        self.of[belief.id] = replace(self.of[belief.id], **track)

    def tell(self, kind: str, template: str, *ids: int, confidence: float = 0.9) -> None:
        """Add an event; its template speaks of the objects as {0}, {1}."""
        text = sentence(self.mind, template, *ids, confidence=confidence)
        self.events.append(
            Event(kind, self.now, self.observation.frame_index, text, ids[:1], confidence)
        )

    def near(self, a: Region, b: Region) -> bool:
        """Whether two regions are so close that one may hide a part of the other."""
        contact = self.settings.contact_px
        x, y, width, height = a.bbox
        left, top, w, h = b.bbox
        # Most pairs are far apart along one of the axes already.
        if not (-w - contact <= left - x <= width + contact):
            return False
        if not (-h - contact <= top - y <= height + contact) or box_gap(a.bbox, b.bbox) > contact:
            return False
        # As far as relations look in the same step, so that the gap is worked out once.
        gap = outline_gap(a, b, max(contact, NEAR_SHARE * image_diagonal(self.mind.frame_size)))
        return gap is not None and gap <= contact
