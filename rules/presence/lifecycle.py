"""The lifecycle of an object: every state transition is made, and reported, here.

    initiate -> TENTATIVE -- confirm --> VISIBLE -- occlude --> OCCLUDED
                    |                       |  ----- lose -----> LOST
                    |                       |  ----- leave ----> LEFT
                    |                       <----- reappear ---- OCCLUDED, LOST, LEFT
                    <------- demote -------- VISIBLE (it was only a part of another)
    delete from any state: merged into a known object (`reidentification.py`), or forgotten (`objects.py`)

A region that appears initiates an object; the other transitions are decided in `initiation.py`,
`occlusion.py` and `reidentification.py`. The state is stored once: in `ObjectBelief.confirmed` and
`ObjectBelief.presence`; the track adds only whether a hidden object is lost.
"""

from __future__ import annotations

from enum import StrEnum

from visup.agent import ObjectBelief, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.presence.object_tracks import ObjectTrack, came_to
from visup.rules.presence.step_context import StepContext

EXIT_CONFIDENCE = 0.9


class LifecycleState(StrEnum):
    """Lifecycle state of an object."""

    TENTATIVE = "tentative"
    VISIBLE = "visible"
    OCCLUDED = "occluded"
    LOST = "lost"
    LEFT = "left"


TRANSITIONS = frozenset(
    {
        (LifecycleState.TENTATIVE, LifecycleState.VISIBLE),
        (LifecycleState.VISIBLE, LifecycleState.TENTATIVE),
        (LifecycleState.VISIBLE, LifecycleState.OCCLUDED),
        (LifecycleState.VISIBLE, LifecycleState.LOST),
        (LifecycleState.VISIBLE, LifecycleState.LEFT),
        (LifecycleState.OCCLUDED, LifecycleState.VISIBLE),
        (LifecycleState.LOST, LifecycleState.VISIBLE),
        (LifecycleState.LEFT, LifecycleState.VISIBLE),
    }
)
"""Allowed transitions: (from, to)."""


def state_of(belief: ObjectBelief, track: ObjectTrack | None) -> LifecycleState:
    """The lifecycle state of an object, from the belief about it."""
    if not belief.confirmed:
        return LifecycleState.TENTATIVE
    if belief.presence is Presence.SEEN:
        return LifecycleState.VISIBLE
    if belief.presence is Presence.LEFT:
        return LifecycleState.LEFT
    return LifecycleState.LOST if track is not None and track.lost else LifecycleState.OCCLUDED


def confirm(
    context: StepContext, belief: ObjectBelief, kind: str, template: str, confidence: float
) -> None:
    """Confirm a tentative object, and report its entry.

    Args:
        context: The step.
        belief: The object.
        kind: Kind of the event.
        template: Sentence of the event; {0} is the object.
        confidence: Confidence of the event, 0 to 1.
    """
    context.store(replace(belief, confirmed=True))
    context.report(kind, template, belief.id, confidence=confidence)


def demote(context: StepContext, belief: ObjectBelief) -> None:
    """Make a part of another object tentative again."""
    context.store(replace(belief, confirmed=False))


def occlude(context: StepContext, belief: ObjectBelief, occluder: ObjectBelief | None) -> None:
    """Report that an object is hidden by another one, or by something unknown (None)."""
    known = occluder if occluder is not None and occluder.confirmed else None
    came = known is not None and came_to(context.tracks[belief.id], known.region)
    _go(context, belief, Presence.HIDDEN, lost=False, into=known.id if known and came else None)
    if known is not None:
        context.report("occlusion", "{0} {is} hidden by {1}.", belief.id, known.id)
    else:
        context.report("occlusion", "{0} {is} hidden.", belief.id)


def lose(context: StepContext, belief: ObjectBelief) -> None:
    """Report that an object is lost: it is no longer seen, for no apparent reason."""
    _go(context, belief, Presence.HIDDEN, lost=True)
    template = "{0} {is} lost: it is no longer seen, for no apparent reason."
    context.report("lost", template, belief.id)


def leave(context: StepContext, belief: ObjectBelief) -> None:
    """Report that an object has left over the border of the image."""
    _go(context, belief, Presence.LEFT, lost=False)
    template = "{0} {leaves} the field of view."
    context.report("exit", template, belief.id, confidence=EXIT_CONFIDENCE)


def _go(
    context: StepContext,
    belief: ObjectBelief,
    where: Presence,
    *,
    lost: bool,
    into: int | None = None,
) -> None:
    gone = replace(belief, presence=where)
    context.store(gone, lost=lost, partial_since=None, clear_since=None, vanished_into=into)


def reappear(context: StepContext, belief: ObjectBelief) -> None:
    """Report that an object is visible again after it was occluded, was lost, or had left."""
    before = state_of(belief, context.tracks[belief.id])
    seen = replace(belief, presence=Presence.SEEN)
    context.store(seen, lost=False, clear_since=None, partial_since=None, vanished_into=None)
    if before is LifecycleState.LEFT:
        context.report("entry", "{0} {comes} back into the field of view.", belief.id)
    elif before is LifecycleState.LOST:
        context.report("found", "{0} {is} seen again.", belief.id)
    else:
        context.report("reappearance", "{0} {reappears}.", belief.id)
