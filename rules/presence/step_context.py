"""The mutable state of one step of presence reasoning."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from visup.agent import Event, Mind, ObjectBelief, Observation, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.outlines import NEAR_SHARE, outline_gap
from visup.rules.geometry.regions import box_gap, image_diagonal
from visup.rules.presence.association import recognised
from visup.rules.presence.fragments import FragmentHypothesis
from visup.rules.presence.object_tracks import ObjectTrack
from visup.rules.presence.settings import PresenceSettings
from visup.rules.wording.conditions import Condition, DecisionLog, decide
from visup.rules.wording.sentences import sentence


@dataclass(slots=True)
class StepContext:
    """The state of a step in progress; lives only while the reasoner runs.

    Attributes:
        mind: The mind so far.
        observation: The observation.
        tracks: Object id -> its track.
        fragments: Object id -> whether it may be only a part of another.
        settings: Settings of the reasoner.
        start: Time of the first observation of regions, seconds.
        log: Records the conditions of decisions for explanations, or None.
        events: Events reported in this step.
    """

    mind: Mind
    observation: Observation
    tracks: dict[int, ObjectTrack]
    fragments: Mapping[int, FragmentHypothesis]
    settings: PresenceSettings
    start: float
    log: DecisionLog | None = None
    events: list[Event] = field(default_factory=list)
    _recognised: frozenset[int] | None = None
    _sorted: tuple[Mapping[int, ObjectBelief], list[ObjectBelief]] | None = None

    @property
    def now(self) -> float:
        """Time of the observation, seconds."""
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
        """Confirmed objects without their own region now, unless they left."""
        now, left = self.now, Presence.LEFT
        return [
            b
            for b in self.objects()
            if b.last_seen < now and b.confirmed and b.presence is not left
        ]

    @property
    def recognised(self) -> frozenset[int]:
        """Objects recognised by appearance now; see `recognised`."""
        if self._recognised is None:
            self._recognised = recognised(self.mind, self.observation)
        return self._recognised

    def may_be_part(self, new: ObjectBelief, body: ObjectBelief | None = None) -> bool:
        """Whether an object may be only a fragment of `body`, or of any body if None."""
        fragment = self.fragments.get(new.id)
        if fragment is None or new.id in self.recognised:
            return False
        return fragment.holds and (body is None or fragment.body == body.id)

    def decide(self, kind: str, object_id: int, conditions: Iterable[Condition]) -> bool:
        """Whether all conditions of a decision about an object are met; logs them."""
        return decide(conditions, self.log, kind, (object_id,))

    def store(self, belief: ObjectBelief, **track: object) -> None:
        """Store a belief, and replace fields of the object's track, given by name."""
        self.mind = self.mind.with_objects(belief)
        if track:
            self.tracks[belief.id] = replace(self.tracks[belief.id], **track)

    def report(self, kind: str, template: str, *ids: int, confidence: float = 0.9) -> None:
        """Add an event; its template refers to the objects as {0}, {1}."""
        text = sentence(self.mind, template, *ids, confidence=confidence)
        self.events.append(
            Event(kind, self.now, self.observation.frame_index, text, ids[:1], confidence)
        )

    def near(self, a: Region, b: Region) -> bool:
        """Whether two regions are close enough for one to hide a part of the other."""
        contact = self.settings.contact_px
        x, y, width, height = a.bbox
        left, top, w, h = b.bbox
        # Most pairs are far apart along one axis.
        if not (-w - contact <= left - x <= width + contact):
            return False
        if not (-h - contact <= top - y <= height + contact) or box_gap(a.bbox, b.bbox) > contact:
            return False
        # The same bound as relations use in this step, so that the gap is computed once.
        gap = outline_gap(a, b, max(contact, NEAR_SHARE * image_diagonal(self.mind.frame_size)))
        return gap is not None and gap <= contact
