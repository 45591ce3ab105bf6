"""Who goes, hides and comes back: a little of an object shows, most of it again, or nothing."""

from __future__ import annotations

from visup.agent import ObjectBelief, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import expanded, pixels_in, shared_pixels
from visup.rules.presence.object_tracks import (
    ObjectTrack,
    at_border,
    heading_out,
    predicted_box,
    predicted_share_outside,
)
from visup.rules.presence.step_context import StepContext


def update_visible(work: StepContext) -> None:
    """Confirmed objects that are seen now: do they hide, leave, come back?"""
    for belief in work.seen():
        track = work.of[belief.id]
        if not belief.confirmed:
            continue
        if belief.presence is Presence.SEEN:
            _check_hiding(work, belief, track)
        else:
            _check_reappearance(work, belief, track)


def _check_hiding(work: StepContext, belief: ObjectBelief, track: ObjectTrack) -> None:
    s = work.settings
    leaving = (
        track.visible < s.leaving_share
        and at_border(track.region, work.mind.frame_size)
        and heading_out(track, work.mind.frame_size)
    )
    hiding = track.visible < s.hidden_share and _occluder(work, belief) is not None
    if not (leaving or hiding):
        work.put(belief, partial_since=None)
        return
    since = work.now if track.partial_since is None else track.partial_since
    work.put(belief, partial_since=since)
    if work.now - since < s.partial_s - 1e-6:
        return
    if hiding:
        _hide(work, belief)
    else:
        _leave(work, belief, 0.9)


def _check_reappearance(work: StepContext, belief: ObjectBelief, track: ObjectTrack) -> None:
    s = work.settings
    crowded = _occluder(work, belief) is not None
    shows = track.visible > s.shown_share and (
        belief.presence is Presence.HIDDEN or track.visible > 2 * s.leaving_share
    )
    clear = belief.presence is Presence.HIDDEN and not crowded and track.visible > s.hidden_share
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
        work.tell("entry", "{0} {comes} back into the field of view.", belief.id)
    elif told == "lost":
        work.tell("found", "{0} {is} seen again.", belief.id)
    else:
        work.tell("reappearance", "{0} {reappears}.", belief.id)


def update_missing(work: StepContext) -> None:
    """Confirmed objects without a region: hidden, gone, or lost?"""
    s = work.settings
    for belief in work.missing():
        track = work.of.get(belief.id)
        if track is None or belief.presence is not Presence.SEEN:
            continue
        if track.merged_with is not None or work.now - track.seen_at < s.settle_s - 1e-6:
            continue
        cover = _occluder(work, belief)
        out = heading_out(track, work.mind.frame_size) and (
            track.visible < 0.35
            or predicted_share_outside(track, work.now, work.mind.frame_size) > 0.5
        )
        if out and (cover is None or track.visible > s.hidden_share):
            _leave(work, belief, 0.9)
        elif cover is not None and _is_hidden_by(work, track, cover):
            _hide(work, belief, cover)
        elif work.now - track.seen_at >= s.lost_s - 1e-6:
            work.put(replace(belief, presence=Presence.HIDDEN), told="lost", clear_since=None)
            work.tell(
                "lost", "{0} {is} lost: it is no longer seen, and nothing tells why.", belief.id
            )


def _is_hidden_by(work: StepContext, track: ObjectTrack, cover: ObjectBelief) -> bool:
    """Whether so little of a missing object would show beside its cover that it is not just missed."""
    s = work.settings
    covered = shared_pixels(cover.region, track.region) / max(1.0, track.region.area)
    showing = track.visible * (1.0 - covered)
    return showing < s.hidden_share or work.now - track.seen_at >= s.missed_s - 1e-6


def _occluder(work: StepContext, belief: ObjectBelief) -> ObjectBelief | None:
    """The object whose region stands where this one should be, or beside what is left of it."""
    track, s = work.of[belief.id], work.settings
    place = predicted_box(track, work.now)
    best: tuple[float, ObjectBelief] | None = None
    for other in work.seen():
        if other.id == belief.id or work.doubted(other, belief):
            continue
        if belief.last_seen == work.now and work.near(belief.region, other.region):
            return other
        # What stands on the very pixels where it was last seen has moved there since.
        share = shared_pixels(other.region, track.region) / max(1.0, track.region.area)
        if track.visible < s.whole_share:
            # Of one that was going out of sight already, the rest may be anywhere in its place.
            spot = expanded(track.region.bbox, 6)
            share = max(
                share,
                pixels_in(other.region, place) / max(1, place[2] * place[3]),
                pixels_in(other.region, spot) / max(1, spot[2] * spot[3]),
            )
        if share > 0.3 and (best is None or share > best[0]):
            best = (share, other)
    return best[1] if best else None


def _hide(work: StepContext, belief: ObjectBelief, cover: ObjectBelief | None = None) -> None:
    cover = cover or _occluder(work, belief)
    hidden = replace(belief, presence=Presence.HIDDEN)
    work.put(hidden, told="occluded", partial_since=None, clear_since=None)
    if cover is not None and cover.confirmed:
        work.tell("occlusion", "{0} {is} hidden by {1}.", belief.id, cover.id)
    else:
        work.tell("occlusion", "{0} {is} hidden.", belief.id)


def _leave(work: StepContext, belief: ObjectBelief, confidence: float) -> None:
    gone = replace(belief, presence=Presence.LEFT)
    work.put(gone, told="left", partial_since=None, clear_since=None)
    work.tell("exit", "{0} {leaves} the field of view.", belief.id, confidence=confidence)
