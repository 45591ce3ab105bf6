"""Who comes: a region that has been seen steadily, and is no part of another object, enters."""

from __future__ import annotations

from visup.agent import ObjectBelief
from visup.agent.model.fast_replace import replace
from visup.rules.presence.fragments import in_place_of_hidden
from visup.rules.presence.object_tracks import at_border
from visup.rules.presence.reidentification import absorb_parts
from visup.rules.presence.step_context import StepContext

STATIONARY_S = 1.0
"""What was in view for so long before it was seen to move had come before."""


def initiate(work: StepContext, start: float) -> None:
    """Confirm new objects; `start` is the time of the first observation, seconds."""
    s = work.settings
    for belief in work.seen():
        track = work.of[belief.id]
        if belief.confirmed or track.sightings < s.least_sightings:
            continue
        if work.doubted(belief) or in_place_of_hidden(belief, work.mind, work.of):
            continue
        if _is_speck(work, belief):
            continue
        early = track.coherent_since - start <= s.start_s
        at_edge = at_border(track.region, work.mind.frame_size)
        needed = s.entry_s if early or at_edge else s.entry_inside_s
        if work.now - track.coherent_since < needed - 1e-6:
            continue
        if absorb_parts(work, belief):
            continue
        work.put(replace(belief, confirmed=True), told="seen")
        kind, template = _arrival(belief, start, early=early)
        work.tell(kind, template, belief.id, confidence=_track_confidence(belief.region.confidence))


def _track_confidence(confidence: float) -> float:
    """How sure it is that something is there of which each look is so sure.

    It was seen steadily; looks that follow each other err together, so that all of them count as two.
    """
    return 1.0 - (1.0 - confidence) ** 2


def _arrival(belief: ObjectBelief, start: float, *, early: bool) -> tuple[str, str]:
    """Kind and sentence of the event: what rested in view before it moved does not enter."""
    since = belief.region.visible_since
    if early:
        return "entry", "{0} {is} in view."
    if since is None or belief.first_seen - since < STATIONARY_S:
        return "entry", "{0} {enters} the field of view."
    if since - start < STATIONARY_S:
        return "noticed", "{0}, in view from the start, {begins} to move."
    return "noticed", "{0}, in view since SINCE, {begins} to move.".replace(
        "SINCE", f"{since:.1f} s"
    )


def _is_speck(work: StepContext, belief: ObjectBelief) -> bool:
    """Whether a region is a speck, of which nobody says what it is."""
    width, height = work.mind.frame_size
    least = work.settings.least_share * width * height
    return not belief.candidates and belief.region.area < least
