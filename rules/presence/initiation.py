"""Initiation: confirms objects whose region is observed steadily and is not a part of another object."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot

from visup.agent import ObjectBelief
from visup.rules.presence.association import hypotheses_by_object
from visup.rules.presence.fragments import in_place_of_hidden
from visup.rules.presence.lifecycle import confirm
from visup.rules.presence.object_tracks import at_border
from visup.rules.presence.reidentification import absorb_parts, parts_of
from visup.rules.presence.step_context import StepContext
from visup.rules.wording.conditions import Condition, at_least

MOVES_SIGMA = 3.0
"""Speed, in its standard deviations, from which an object recognised by appearance is moving."""

STATIONARY_S = 1.0
"""An object in view for longer than this before it moved did not enter now, seconds."""


def confirm_new(context: StepContext) -> None:
    """Confirm tentative objects that are visible now, unless known objects turn out to be parts of them."""
    for belief in context.seen():
        if belief.confirmed or not context.decide("entry", belief.id, _conditions(context, belief)):
            continue
        parts = parts_of(context, belief)
        own = Condition("no known object is only a part of it", not parts)
        if not context.decide("entry", belief.id, (own,)):
            absorb_parts(context, belief, parts)
            continue
        kind, template = _arrival(context, belief)
        confirm(context, belief, kind, template, _track_confidence(belief.region.confidence))


def _conditions(context: StepContext, belief: ObjectBelief) -> Iterator[Condition]:
    """Conditions for the entry of an object: seen steadily, large enough, and not a part of another one."""
    s, track = context.settings, context.tracks[belief.id]
    if _known_at_first_sight(context, belief):
        yield Condition("not part of another object", not context.may_be_part(belief))
        return
    yield at_least("sightings", track.sightings, s.least_sightings)
    yield Condition("not part of another object", not context.may_be_part(belief))
    named = belief.id in context.recognised
    if named and _is_moving(belief) and not _is_known_already(context, belief):
        return
    hidden = not named and in_place_of_hidden(belief, context.mind, context.tracks)
    yield Condition("not in the place of a hidden object", not hidden)
    if not belief.candidates:
        width, height = context.mind.frame_size
        least = s.least_share * width * height
        text = "area, while unidentified,"
        yield at_least(text, belief.region.area, least, " px")
    at_edge = at_border(track.region, context.mind.frame_size)
    needed = s.entry_s if at_edge or _is_early(context, belief) else s.entry_inside_s
    steady = context.now - track.coherent_since
    yield at_least("seen steadily for", steady, needed, " s", slack=1e-6)


def _known_at_first_sight(context: StepContext, belief: ObjectBelief) -> bool:
    """Whether it was recognised by appearance in the first frame, with little doubt.

    Then it need not be seen steadily, which only serves to exclude shadows and flicker.
    """
    if context.now > context.start or belief.id not in context.recognised:
        return False
    found = hypotheses_by_object(context.mind, context.observation).get(belief.id, ())
    return max((h.similarity for h in found), default=0.0) >= context.settings.sure_similarity


def _is_moving(belief: ObjectBelief) -> bool:
    """Whether its region certainly moves; a moving object needs no more evidence than its recognition."""
    region = belief.region
    return hypot(*region.velocity) > MOVES_SIGMA * region.velocity_sigma > 0.0


def _is_known_already(context: StepContext, belief: ObjectBelief) -> bool:
    """Whether another object has the name by which it was recognised: it may be that object, seen again."""
    found = hypotheses_by_object(context.mind, context.observation).get(belief.id, ())
    names = {h.name for h in found}
    return any(
        o.confirmed and o.name in names for o in context.mind.objects.values() if o.id != belief.id
    )


def _is_early(context: StepContext, belief: ObjectBelief) -> bool:
    """Whether it was present when the video began."""
    since = context.tracks[belief.id].coherent_since
    return since - context.start <= context.settings.start_s


def _track_confidence(confidence: float) -> float:
    """Confidence of existence, from the confidence of each observation.

    Observations in succession have correlated errors, so all of them count as two.
    """
    return 1.0 - (1.0 - confidence) ** 2


def _arrival(context: StepContext, belief: ObjectBelief) -> tuple[str, str]:
    """Kind and sentence of the event: an object at rest in view before it moved does not enter."""
    since = belief.region.visible_since
    if _is_early(context, belief):
        return "entry", "{0} {is} in view."
    if since is None or belief.first_seen - since < STATIONARY_S:
        return "entry", "{0} {enters} the field of view."
    if since - context.start < STATIONARY_S:
        return "noticed", "{0}, in view from the start, {begins} to move."
    moves = "{0}, in view since SINCE, {begins} to move."
    return "noticed", moves.replace("SINCE", f"{since:.1f} s")
