"""Who is there: entry, exit, occlusion, reappearance (paper, section 5).

An entry is told when a region has been seen steadily; a region that vanished was hidden when
another one stands where it should be, left when it was going over the image border, went up in
another when that grew into the union of the two, and is lost when none of that explains it: a
camera that sees motion loses what stops. A decision waits over several frames. A new region near
the place where a missing object should be is that object, which keeps its id.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import MappingProxyType

from visup.agent import Event, Mind, ObjectBelief, Observation, Outcome, Presence, Region
from visup.rules.geometry import (
    box_gap,
    box_iou,
    box_overlap,
    grow,
    moved,
    outline_gap,
    pixels_in,
    shared_pixels,
)
from visup.rules.objects import drop_objects, give_region
from visup.rules.sentences import sentence
from visup.rules.tracks import (
    TRACKS,
    Track,
    Tracks,
    at_border,
    expected_box,
    expected_outside,
    first_sight,
    follow,
    heading_out,
    tracks,
    visible_share,
)

__all__ = ["PresenceSettings", "SeePresence", "visible_share"]


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
        lost_s: The same when nothing explains it.
        partial_s: How long little must show before exit or occlusion is told.
        hidden_share: Below this share in sight, beside another region, an object is occluded.
        leaving_share: Below this share, going over the border, it has left.
        shown_share: Above this share a hidden object has reappeared.
        shown_s: How long it must show, or stay in the clear, before that is told.
        whole_share: An object of which less shows was being hidden, and went up in no other.
        contact_px: Regions closer than this may hide parts of each other.
        adopt_s: A new region must be seen this long before it can be a hidden object.
    """

    entry_s: float = 0.36
    entry_inside_s: float = 1.0
    start_s: float = 2.0
    least_sightings: int = 3
    allowed_gap_s: float = 0.25
    settle_s: float = 0.3
    lost_s: float = 2.0
    partial_s: float = 0.16
    hidden_share: float = 0.2
    leaving_share: float = 0.12
    shown_share: float = 0.5
    shown_s: float = 0.12
    whole_share: float = 0.6
    contact_px: float = 4.0
    adopt_s: float = 0.12


@dataclass(slots=True)
class _Work:
    """One step in the making; lives only while the thinker runs."""

    mind: Mind
    observation: Observation
    of: dict[int, Track]
    events: list[Event]

    @property
    def now(self) -> float:
        return self.observation.time

    def seen(self) -> list[ObjectBelief]:
        return [b for _, b in sorted(self.mind.objects.items()) if b.last_seen == self.now]

    def missing(self) -> list[ObjectBelief]:
        """Confirmed objects without a region of their own now, unless they left."""
        return [
            b
            for _, b in sorted(self.mind.objects.items())
            if b.confirmed and b.last_seen < self.now and b.presence is not Presence.LEFT
        ]

    def put(self, belief: ObjectBelief, **track: object) -> None:
        self.mind = self.mind.with_objects(belief)
        self.of[belief.id] = replace(self.of[belief.id], **track)  # type: ignore[arg-type]

    def tell(self, kind: str, template: str, *ids: int, confidence: float = 0.9) -> None:
        text = sentence(self.mind, template, *ids, confidence=confidence)
        self.events.append(
            Event(kind, self.now, self.observation.frame_index, text, ids[:1], confidence)
        )


@dataclass(frozen=True, slots=True)
class SeePresence:
    """Thinker of the cogitate phase: keeps who is there, tells who comes, goes, hides and shows.

    When no behaviour looked for regions in this step, nothing is concluded.
    """

    settings: PresenceSettings = PresenceSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        if not observation.observed("region"):
            return Outcome(mind)
        old = tracks(mind)
        start = observation.time if old.start is None else old.start
        known = {i: t for i, t in old.of.items() if i in mind.objects}
        work = _Work(mind, observation, known, [])
        self._adopt(work)
        self._merge(work)
        self._follow(work)
        self._enter(work, start)
        self._show(work)
        self._miss(work)
        kept = {i: t for i, t in work.of.items() if i in work.mind.objects}
        mind = work.mind.remember(TRACKS, Tracks(start, MappingProxyType(kept)))
        return Outcome(mind, tuple(work.events))

    def _adopt(self, work: _Work) -> None:
        """Give new regions to the missing objects that they show."""
        for new in work.seen():
            if new.confirmed:
                continue
            scored = [(self._likeness(work, new, b), b) for b in work.missing() if b.id in work.of]
            score, old = max(scored, key=lambda s: (s[0], -s[1].id), default=(0.0, new))
            if score <= 0.0:
                continue
            work.mind = drop_objects(work.mind, frozenset({new.id}))
            work.mind = give_region(work.mind, new.region.id, old.id)
            taken = replace(old, region=new.region, last_seen=work.now)
            work.put(taken, merged_with=None, changed_at=work.now)

    def _likeness(self, work: _Work, new: ObjectBelief, old: ObjectBelief) -> float:
        """How well a new region suits a missing object; 0 when it does not."""
        track = work.of[old.id]
        if track.merged_with is not None:
            iou = box_iou(new.region.bbox, old.region.bbox)
            return iou if iou > 0.3 else 0.0
        ratio = new.region.area / max(track.reference, 1.0)
        if old.presence is Presence.HIDDEN and work.now - new.first_seen < self.settings.adopt_s:
            return 0.0
        if ratio > 1.8 or (track.told == "seen" and ratio < 0.3):
            return 0.0
        # The longer it was out of sight, the less is known of where it is.
        away = min(work.now - track.whole_at, 3.0)
        place = grow(expected_box(track, work.now), round(4 + 8 * away))
        within = box_overlap(new.region.bbox, place) / max(1, _box_area(new.region))
        if within < 0.5 or not _same_name(new, old):
            return 0.0
        return within

    def _merge(self, work: _Work) -> None:
        """Find objects that went up in a region grown into the union of two."""
        for gone in work.missing():
            track = work.of.get(gone.id)
            if track is None or track.told != "seen":
                continue
            if track.merged_with is not None:
                self._stay_merged(work, gone, track)
                continue
            if work.now - track.seen_at > self.settings.settle_s:
                continue
            host = next((b for b in work.seen() if self._grew_by(work, b, track)), None)
            if host is not None:
                again = track.parted_at is not None and work.now - track.parted_at < 0.5
                since = track.merged_since if again else work.now
                work.put(gone, merged_with=host.id, merged_since=since)

    def _stay_merged(self, work: _Work, gone: ObjectBelief, track: Track) -> None:
        host = work.mind.objects.get(track.merged_with or -1)
        if host is None or host.presence is not Presence.SEEN:
            work.put(gone, merged_with=None, parted_at=work.now)
            return
        before = work.of[host.id].region
        if host.last_seen == work.now and host.region.area < 0.75 * before.area:
            # The host's region is its own again; where the other one is shows in the next frames.
            work.put(gone, merged_with=None, parted_at=work.now, seen_at=work.now)
            return
        dx = host.region.centroid[0] - before.centroid[0]
        dy = host.region.centroid[1] - before.centroid[1]
        work.put(replace(gone, region=moved(gone.region, dx, dy)), seen_at=work.now)

    def _grew_by(self, work: _Work, host: ObjectBelief, gone: Track) -> bool:
        before = work.of.get(host.id)
        if before is None or not host.confirmed or gone.visible < self.settings.whole_share:
            return False
        parts = gone.region.area + before.region.area
        if host.region.area < before.region.area + 0.5 * gone.region.area:
            return False
        shared = shared_pixels(host.region, gone.region)
        shared += shared_pixels(host.region, before.region)
        return shared / (host.region.area + parts - shared) > 0.7

    def _follow(self, work: _Work) -> None:
        seen = work.seen()
        around = self._around(work)
        hosts = {t.merged_with for t in work.of.values()}
        for belief in seen:
            track = work.of.get(belief.id)
            if track is None:
                work.of[belief.id] = first_sight(belief.region, work.now)
                continue
            if track.merged_with is not None:
                # It has a region of its own again.
                work.put(belief, merged_with=None, parted_at=work.now)
                track = work.of[belief.id]
            crowded = belief.id in hosts or any(
                self._near(belief.region, other.region) for other in around if other.id != belief.id
            )
            work.of[belief.id] = follow(
                track, belief.region, work.now, crowded, self.settings.allowed_gap_s
            )

    def _around(self, work: _Work) -> list[ObjectBelief]:
        """Objects that are seen, or were a flicker ago: all that may hide a part of another."""
        since = work.now - self.settings.allowed_gap_s
        return [b for b in work.mind.objects.values() if b.last_seen >= since]

    def _near(self, a: Region, b: Region) -> bool:
        if box_gap(a.bbox, b.bbox) > self.settings.contact_px:
            return False
        return outline_gap(a, b, self.settings.contact_px) is not None

    def _enter(self, work: _Work, start: float) -> None:
        s = self.settings
        for belief in work.seen():
            track = work.of[belief.id]
            if belief.confirmed or track.sightings < s.least_sightings:
                continue
            if self._fragment(work, belief):
                continue
            early = track.coherent_since - start <= s.start_s
            at_edge = at_border(track.region, work.mind.frame_size)
            needed = s.entry_s if early or at_edge else s.entry_inside_s
            if work.now - track.coherent_since < needed - 1e-6:
                continue
            work.put(replace(belief, confirmed=True), told="seen")
            template = "{0} is in view." if early else "{0} enters the field of view."
            work.tell("entry", template, belief.id, confidence=belief.region.confidence)

    def _fragment(self, work: _Work, new: ObjectBelief) -> bool:
        """Whether a new region may be a part of an object that something else hides in part."""
        for old in work.mind.objects.values():
            track = work.of.get(old.id)
            if not old.confirmed or old.presence is Presence.LEFT or track is None:
                continue
            if old.presence is Presence.SEEN and track.visible > 0.7:
                continue
            place = grow(expected_box(track, work.now), 6)
            if box_overlap(place, new.region.bbox) > 0.6 * _box_area(new.region):
                return True
        return False

    def _show(self, work: _Work) -> None:
        """Confirmed objects that are seen now: do they hide, leave, come back?"""
        for belief in work.seen():
            track = work.of[belief.id]
            if not belief.confirmed:
                continue
            if belief.presence is Presence.SEEN:
                self._little_shows(work, belief, track)
            else:
                self._much_shows(work, belief, track)

    def _little_shows(self, work: _Work, belief: ObjectBelief, track: Track) -> None:
        s = self.settings
        leaving = (
            track.visible < s.leaving_share
            and at_border(track.region, work.mind.frame_size)
            and heading_out(track, work.mind.frame_size)
        )
        hiding = track.visible < s.hidden_share and self._cover(work, belief) is not None
        if not (leaving or hiding):
            work.put(belief, partial_since=None)
            return
        since = work.now if track.partial_since is None else track.partial_since
        work.put(belief, partial_since=since)
        if work.now - since < s.partial_s - 1e-6:
            return
        if hiding:
            self._hide(work, belief)
        else:
            self._leave(work, belief, 0.9)

    def _much_shows(self, work: _Work, belief: ObjectBelief, track: Track) -> None:
        s = self.settings
        crowded = self._cover(work, belief) is not None
        shows = track.visible > s.shown_share and (
            belief.presence is Presence.HIDDEN or track.visible > 2 * s.leaving_share
        )
        clear = (
            belief.presence is Presence.HIDDEN and not crowded and track.visible > s.hidden_share
        )
        if not (shows or clear):
            work.put(belief, clear_since=None)
            return
        since = work.now if track.clear_since is None else track.clear_since
        work.put(belief, clear_since=since)
        if work.now - since < s.shown_s - 1e-6:
            return
        shown = replace(belief, presence=Presence.SEEN)
        told = track.told
        work.put(shown, told="seen", clear_since=None, partial_since=None)
        if told == "left":
            work.tell("entry", "{0} comes back into the field of view.", belief.id)
        elif told == "lost":
            work.tell("found", "{0} is seen again.", belief.id)
        else:
            work.tell("reappearance", "{0} reappears.", belief.id)

    def _miss(self, work: _Work) -> None:
        """Confirmed objects without a region: hidden, gone, or lost?"""
        s = self.settings
        for belief in work.missing():
            track = work.of.get(belief.id)
            if track is None or belief.presence is not Presence.SEEN:
                continue
            if track.merged_with is not None or work.now - track.seen_at < s.settle_s - 1e-6:
                continue
            cover = self._cover(work, belief)
            out = heading_out(track, work.mind.frame_size) and (
                track.visible < 0.35
                or expected_outside(track, work.now, work.mind.frame_size) > 0.5
            )
            if out and (cover is None or track.visible > s.hidden_share):
                self._leave(work, belief, 0.9)
            elif cover is not None:
                self._hide(work, belief, cover)
            elif work.now - track.seen_at >= s.lost_s - 1e-6:
                work.put(replace(belief, presence=Presence.HIDDEN), told="lost", clear_since=None)
                work.tell("lost", "{0} is no longer seen, and nothing tells why.", belief.id)

    def _cover(self, work: _Work, belief: ObjectBelief) -> ObjectBelief | None:
        """The object whose region stands where this one should be, or beside what is left of it."""
        track = work.of[belief.id]
        place = expected_box(track, work.now)
        best: tuple[float, ObjectBelief] | None = None
        for other in work.seen():
            if other.id == belief.id:
                continue
            if belief.last_seen == work.now and self._near(belief.region, other.region):
                return other
            spot = grow(track.region.bbox, 6)
            share = max(
                pixels_in(other.region, place) / max(1, place[2] * place[3]),
                pixels_in(other.region, spot) / max(1, spot[2] * spot[3]),
            )
            if share > 0.3 and (best is None or share > best[0]):
                best = (share, other)
        return best[1] if best else None

    def _hide(self, work: _Work, belief: ObjectBelief, cover: ObjectBelief | None = None) -> None:
        cover = cover or self._cover(work, belief)
        hidden = replace(belief, presence=Presence.HIDDEN)
        work.put(hidden, told="occluded", partial_since=None, clear_since=None)
        if cover is not None and cover.confirmed:
            work.tell("occlusion", "{0} is hidden by {1}.", belief.id, cover.id)
        else:
            work.tell("occlusion", "{0} is hidden.", belief.id)

    def _leave(self, work: _Work, belief: ObjectBelief, confidence: float) -> None:
        gone = replace(belief, presence=Presence.LEFT)
        work.put(gone, told="left", partial_since=None, clear_since=None)
        work.tell("exit", "{0} leaves the field of view.", belief.id, confidence=confidence)


def _box_area(region: Region) -> int:
    return max(1, region.bbox[2] * region.bbox[3])


def _same_name(new: ObjectBelief, old: ObjectBelief) -> bool:
    """Whether two beliefs may be of one thing: not when both have a clear and different name."""
    if not new.candidates or not old.candidates:
        return True
    sure = new.strength > 0.6 and old.strength > 0.6
    return not sure or new.name == old.name
