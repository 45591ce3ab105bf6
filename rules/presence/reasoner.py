"""Who is there: entry, exit, occlusion, reappearance (paper, section 5).

An entry is told when a region has been seen steadily; a region that vanished was hidden when
another one stands where it should be, left when it was going over the image border, went up in
another when that grew into the union of the two, and is lost when none of that explains it: a
camera that sees motion loses what stops. A decision waits over several frames. A new region near
the place where a missing object should be is that object, which keeps its id; one at another
object may be a part of it and has to show that it is not.

Each of these stands in a file of its own, in the order in which `PresenceReasoner` runs them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Observation, Outcome
from visup.agent.model.fast_replace import replace
from visup.rules.presence.fragments import (
    FRAGMENTS,
    FragmentHypothesis,
    FragmentSettings,
    FragmentTest,
)
from visup.rules.presence.initiation import initiate
from visup.rules.presence.merging import merge
from visup.rules.presence.object_tracks import (
    TRACKS,
    PresenceMemory,
    new_track,
    presence_memory,
    update_track,
    visible_share,
)
from visup.rules.presence.occlusion import update_missing, update_visible
from visup.rules.presence.reidentification import reidentify
from visup.rules.presence.step_context import PresenceSettings, StepContext

__all__ = ["PresenceReasoner", "PresenceSettings", "visible_share"]


@dataclass(frozen=True, slots=True)
class PresenceReasoner:
    """Reasoner of the cogitate phase: keeps who is there, tells who comes, goes, hides and shows.

    When no behaviour looked for regions in this step, nothing is concluded.
    """

    settings: PresenceSettings = field(default_factory=PresenceSettings)
    fragments: FragmentSettings = field(default_factory=FragmentSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Reasoner`."""
        if not observation.observed("region"):
            return Outcome(mind)
        old = presence_memory(mind)
        start = observation.time if old.start is None else old.start
        known = {i: t for i, t in old.of.items() if i in mind.objects}
        doubts: Mapping[int, FragmentHypothesis] = mind.memory.get(FRAGMENTS, MappingProxyType({}))
        work = StepContext(mind, observation, known, doubts, self.settings)
        reidentify(work)
        merge(work)
        _update_tracks(work)
        starting = work.now - start <= self.settings.start_s
        work.doubts = FragmentTest(self.fragments)(doubts, work.mind, work.of, starting=starting)
        initiate(work, start)
        update_visible(work)
        update_missing(work)
        kept = {i: t for i, t in work.of.items() if i in work.mind.objects}
        told = {
            TRACKS: PresenceMemory(start, MappingProxyType(kept)),
            FRAGMENTS: MappingProxyType(dict(work.doubts)),
        }
        memory = MappingProxyType({**work.mind.memory, **told})
        return Outcome(replace(work.mind, memory=memory), tuple(work.events))


def _update_tracks(work: StepContext) -> None:
    seen = work.seen()
    around = _recently_seen(work)
    hosts = {t.merged_with for t in work.of.values()}
    for belief in seen:
        track = work.of.get(belief.id)
        if track is None:
            work.of[belief.id] = new_track(belief.region, work.now)
            continue
        if track.merged_with is not None:
            # It has a region of its own again.
            work.put(belief, merged_with=None, parted_at=work.now)
            track = work.of[belief.id]
        crowded = belief.id in hosts or any(
            work.near(belief.region, other.region)
            for other in around
            if other.id != belief.id and not work.doubted(other, belief)
        )
        work.of[belief.id] = update_track(
            track, belief.region, work.now, crowded, work.settings.allowed_gap_s
        )


def _recently_seen(work: StepContext) -> list[ObjectBelief]:
    """Objects that are seen, or were a flicker ago: all that may hide a part of another."""
    since = work.now - work.settings.allowed_gap_s
    return [b for b in work.mind.objects.values() if b.last_seen >= since]
