"""Occlusion, exit, loss and reappearance, from how much of an object is visible.

The conditions for having left are here too (`_exit_conditions` while a little is still visible,
`_missing_exit_conditions` when nothing is): exit and occlusion are distinguished by the same evidence.

"""

from __future__ import annotations

from collections.abc import Iterator

from visup.agent import ObjectBelief, Presence
from visup.rules.geometry.regions import expanded, pixels_in, shared_pixels
from visup.rules.presence.lifecycle import leave, lose, occlude, reappear
from visup.rules.presence.object_tracks import (
    ObjectTrack,
    at_border,
    heading_out,
    predicted_box,
    predicted_share_outside,
)
from visup.rules.presence.step_context import StepContext
from visup.rules.wording.conditions import Condition, at_least, less_than, more_than

PARTLY_OUT = 0.35
"""An object with a smaller visible share when last seen was on its way out."""


def update_visible(context: StepContext) -> None:
    """Decide on occlusion, exit or reappearance of the confirmed objects that are visible now."""
    for belief in context.seen():
        if not belief.confirmed:
            continue
        if belief.presence is Presence.SEEN:
            _check_hiding(context, belief)
        else:
            _check_reappearance(context, belief)


def _check_hiding(context: StepContext, belief: ObjectBelief) -> None:
    track = context.tracks[belief.id]
    hiding = context.decide("occlusion", belief.id, _occlusion_conditions(context, belief))
    leaving = context.decide("exit", belief.id, _exit_conditions(context, track, hiding))
    if not (hiding or leaving):
        if track.partial_since is not None:
            context.store(belief, partial_since=None)
        return
    since = context.now if track.partial_since is None else track.partial_since
    context.store(belief, partial_since=since)
    lasted = at_least(
        "that lasts for", context.now - since, context.settings.partial_s, " s", slack=1e-6
    )
    if not context.decide("occlusion" if hiding else "exit", belief.id, (lasted,)):
        return
    if hiding:
        occlude(context, belief, _occluder(context, belief))
    else:
        leave(context, belief)


def _occlusion_conditions(context: StepContext, belief: ObjectBelief) -> Iterator[Condition]:
    """Conditions for the occlusion of an object of which a little is visible."""
    visible, s = context.tracks[belief.id].visible_share, context.settings
    yield less_than("visible share", visible, s.hidden_share)
    yield Condition("another object covers it", _occluder(context, belief) is not None)


def _exit_conditions(context: StepContext, track: ObjectTrack, hiding: bool) -> Iterator[Condition]:
    """Conditions for the exit of an object of which a little is visible."""
    size = context.mind.frame_size
    yield less_than("visible share", track.visible_share, context.settings.leaving_share)
    yield Condition("it is at the border of the image", at_border(track.region, size))
    yield Condition("it is moving over the border", heading_out(track, size))
    yield Condition("no other object hides it", not hiding)


def _check_reappearance(context: StepContext, belief: ObjectBelief) -> None:
    track = context.tracks[belief.id]
    if not context.decide(
        "reappearance", belief.id, _reappearance_conditions(context, belief, track)
    ):
        if track.clear_since is not None:
            context.store(belief, clear_since=None)
        return
    since = context.now if track.clear_since is None else track.clear_since
    context.store(belief, clear_since=since)
    lasted = at_least(
        "that lasts for", context.now - since, context.settings.shown_s, " s", slack=1e-6
    )
    if context.decide("reappearance", belief.id, (lasted,)):
        reappear(context, belief)


def _reappearance_conditions(
    context: StepContext, belief: ObjectBelief, track: ObjectTrack
) -> Iterator[Condition]:
    """Conditions for the reappearance of an object: most of it is visible, or less if nothing covers it."""
    s = context.settings
    if belief.presence is Presence.LEFT:
        needed = max(s.shown_share, 2 * s.leaving_share)
    else:
        needed = s.shown_share
        if _occluder(context, belief) is None:
            needed = min(s.shown_share, s.hidden_share)
    yield more_than("visible share", track.visible_share, needed)


def update_missing(context: StepContext) -> None:
    """Decide on occlusion, exit or loss of the confirmed objects that have no region now."""
    for belief in context.missing():
        track = context.tracks.get(belief.id)
        if track is None or belief.presence is not Presence.SEEN:
            continue
        gate = tuple(_missing_conditions(context, track))
        for kind in ("exit", "occlusion", "loss"):
            context.decide(kind, belief.id, gate)
        if not all(c.met for c in gate):
            continue
        occluder = _occluder(context, belief)
        leaving = context.decide(
            "exit", belief.id, _missing_exit_conditions(context, track, occluder)
        )
        hidden = context.decide(
            "occlusion", belief.id, _missing_occlusion_conditions(context, track, occluder, leaving)
        )
        lost = context.decide(
            "loss", belief.id, _loss_conditions(context, track, leaving or hidden)
        )
        if leaving:
            leave(context, belief)
        elif hidden:
            occlude(context, belief, occluder)
        elif lost:
            lose(context, belief)


def _missing_conditions(context: StepContext, track: ObjectTrack) -> Iterator[Condition]:
    """Conditions for concluding anything from a missing object."""
    yield Condition("it has not merged with another object", track.merged_with is None)
    missing = context.now - track.last_seen
    yield at_least("missing for", missing, context.settings.settle_s, " s", slack=1e-6)


def _missing_exit_conditions(
    context: StepContext, track: ObjectTrack, occluder: ObjectBelief | None
) -> Iterator[Condition]:
    size = context.mind.frame_size
    yield Condition("it was moving over the border", heading_out(track, size))
    out = (
        track.visible_share < PARTLY_OUT or predicted_share_outside(track, context.now, size) > 0.5
    )
    yield Condition("most of it should be outside by now", out)
    apart = occluder is None or track.visible_share > context.settings.hidden_share
    yield Condition("no other object hides it", apart)


def _missing_occlusion_conditions(
    context: StepContext, track: ObjectTrack, occluder: ObjectBelief | None, leaving: bool
) -> Iterator[Condition]:
    """Conditions for the occlusion of a missing object.

    The segmenter may merely have missed it, unless little of it would be visible or it is missing for long.
    """
    s = context.settings
    yield Condition("it has not left", not leaving)
    yield Condition("another object covers its place", occluder is not None)
    if occluder is None:
        return
    covered = shared_pixels(occluder.region, track.region) / max(1.0, track.region.area)
    showing = track.visible_share * (1.0 - covered)
    if showing < s.hidden_share:
        yield less_than("share that would be visible", showing, s.hidden_share)
    else:
        text = "missing, although much of it should be visible, for"
        yield at_least(text, context.now - track.last_seen, s.missed_s, " s", slack=1e-6)


def _loss_conditions(
    context: StepContext, track: ObjectTrack, explained: bool
) -> Iterator[Condition]:
    yield Condition("no known reason", not explained)
    missing = context.now - track.last_seen
    yield at_least(
        "missing without a known reason for", missing, context.settings.lost_s, " s", slack=1e-6
    )


def _occluder(context: StepContext, belief: ObjectBelief) -> ObjectBelief | None:
    """The object whose region covers the place of this one, or is next to what is visible of it."""
    best: tuple[float, ObjectBelief] | None = None
    for other in context.seen():
        if other.id == belief.id or context.may_be_part(other, belief):
            continue
        if belief.last_seen == context.now and context.near(belief.region, other.region):
            return other
        share = _covered_share(context, context.tracks[belief.id], other)
        if share > 0.3 and (best is None or share > best[0]):
            best = (share, other)
    return best[1] if best else None


def _covered_share(context: StepContext, track: ObjectTrack, other: ObjectBelief) -> float:
    """Share of an object's last or predicted place that another one's region covers, 0 to 1."""
    # A region that covers the object's last pixels has moved there since, so it is in front.
    share = shared_pixels(other.region, track.region) / max(1.0, track.region.area)
    if track.visible_share >= context.settings.whole_share:
        return share
    # The rest of an object that was already disappearing may be anywhere in its place.
    places = predicted_box(track, context.now), expanded(track.region.bbox, 6)
    return max(share, *(pixels_in(other.region, p) / max(1, p[2] * p[3]) for p in places))
