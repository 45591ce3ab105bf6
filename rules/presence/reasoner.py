"""The presence reasoner: entry, exit, occlusion, loss, reappearance (paper, section 5).

A region observed steadily enters. An object without a region is occluded if another one is where it should
be, has left if it was moving over the image border, has merged if another one grew into the union of the two,
and is lost otherwise: motion segmentation loses objects that stop. Decisions wait for several frames. A new
region near the predicted place of a missing object is that object, which keeps its id; one next to another
object may be a part of it and has to prove otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Presence
from visup.rules.presence.fragments import FRAGMENTS, FragmentSettings, FragmentTest
from visup.rules.presence.initiation import confirm_new
from visup.rules.presence.merging import merge
from visup.rules.presence.object_tracks import (
    TRACKS,
    PresenceMemory,
    magnified,
    new_track,
    presence_memory,
    update_track,
    visible_share,
)
from visup.rules.presence.occlusion import update_missing, update_visible
from visup.rules.presence.reidentification import reidentify
from visup.rules.presence.settings import PresenceSettings
from visup.rules.presence.step_context import StepContext
from visup.rules.wording.conditions import Condition, DecisionLog, ExplainableReasoner, Subject

__all__ = ["PresenceReasoner", "PresenceSettings", "visible_share"]


@dataclass(frozen=True, slots=True)
class PresenceReasoner(ExplainableReasoner):
    """Reasoner of the cogitate phase: reports entry, exit, occlusion, loss and reappearance of objects.

    Without a behaviour that looked for regions in this step, nothing is concluded. The `DECISIONS` are
    explained for every object.
    """

    settings: PresenceSettings = field(default_factory=PresenceSettings)
    fragments: FragmentSettings = field(default_factory=FragmentSettings)

    def _preconditions(
        self, mind: Mind, after: Mind, observation: Observation
    ) -> Iterator[tuple[Subject, tuple[Condition, ...]]]:
        for i, belief in mind.objects.items():
            for kind in DECISIONS:
                conditions = _preconditions(kind, belief, after.objects.get(i), observation)
                yield (kind, (i,)), tuple(conditions)

    def _reason(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        if not observation.observed("region"):
            return Outcome(mind)
        context = self._context(mind, observation, log)
        reidentify(context)
        merge(context)
        _update_tracks(context)
        starting = context.now - context.start <= self.settings.start_s
        test = FragmentTest(self.fragments)
        context.fragments = test(context.fragments, context.mind, context.tracks, starting=starting)
        confirm_new(context)
        update_visible(context)
        update_missing(context)
        return Outcome(_remembered(context), tuple(context.events))

    def _context(
        self, mind: Mind, observation: Observation, log: DecisionLog | None
    ) -> StepContext:
        old = presence_memory(mind)
        known = {i: t for i, t in old.tracks.items() if i in mind.objects}
        known = magnified(known, next(iter(observation.of("camera")), None))
        fragments = mind.recall(FRAGMENTS)
        start = observation.time if old.start is None else old.start
        return StepContext(mind, observation, known, fragments, self.settings, start, log)


DECISIONS = ("entry", "exit", "occlusion", "loss", "reappearance")


def _preconditions(
    kind: str, belief: ObjectBelief, after: ObjectBelief | None, observation: Observation
) -> Iterator[Condition]:
    """Preconditions of considering a decision about an object."""
    yield Condition("regions were looked for", observation.observed("region"))
    yield Condition("it is no known object seen again", after is not None)
    seen = after is not None and after.last_seen == observation.time
    if kind == "entry":
        yield Condition("it has not entered before", not belief.confirmed)
        yield Condition("it is seen", seen)
        return
    yield Condition("it has entered", after is not None and after.confirmed)
    if kind == "reappearance":
        yield Condition("it is hidden or has left", belief.presence is not Presence.SEEN)
        yield Condition("it is seen", seen)
        return
    yield Condition("it was not hidden or gone before", belief.presence is Presence.SEEN)
    if kind == "loss":
        yield Condition("it is not seen", not seen)


def _remembered(context: StepContext) -> Mind:
    """The mind with the memory of objects that are still known."""
    tracks = {i: t for i, t in context.tracks.items() if i in context.mind.objects}
    mind = context.mind.remember(TRACKS, PresenceMemory(context.start, MappingProxyType(tracks)))
    return mind.remember(FRAGMENTS, MappingProxyType(dict(context.fragments)))


def _update_tracks(context: StepContext) -> None:
    seen = context.seen()
    around = _recently_seen(context)
    hosts = {t.merged_with for t in context.tracks.values()}
    for belief in seen:
        track = context.tracks.get(belief.id)
        if track is None:
            context.tracks[belief.id] = new_track(belief.region, context.now)
            continue
        if track.merged_with is not None:
            # It has its own region again.
            context.store(belief, merged_with=None, parted_at=context.now)
            track = context.tracks[belief.id]
        crowded = belief.id in hosts or any(
            context.near(belief.region, other.region)
            for other in around
            if other.id != belief.id and not context.may_be_part(other, belief)
        )
        context.tracks[belief.id] = update_track(
            track,
            belief.region,
            context.now,
            crowded,
            context.settings.allowed_gap_s,
            recognised=belief.id in context.recognised,
        )


def _recently_seen(context: StepContext) -> list[ObjectBelief]:
    """Objects visible now or just before a flicker: all that may hide a part of another."""
    since = context.now - context.settings.allowed_gap_s
    return [b for b in context.mind.objects.values() if b.last_seen >= since]
