"""Who is there: entry, exit, occlusion, reappearance (paper, section 5).

An entry is told when a region has been seen steadily; a region that vanished was hidden when
another one stands where it should be, left when it was going over the image border, went up in
another when that grew into the union of the two, and is lost when none of that explains it: a
camera that sees motion loses what stops. A decision waits over several frames. A new region near
the place where a missing object should be is that object, which keeps its id; one at another
object may be a part of it and has to show that it is not.

Each of these stands in a file of its own, in the order in which `SeePresence` runs them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Observation, Outcome
from visup.agent.model.fast_replace import replace
from visup.rules.presence.fragments import FRAGMENTS, Doubt, Doubting, FragmentSettings
from visup.rules.presence.initiation import enter
from visup.rules.presence.merging import merge
from visup.rules.presence.occlusion import miss, show
from visup.rules.presence.reidentification import adopt
from visup.rules.presence.sightings import (
    TRACKS,
    Tracks,
    first_sight,
    follow,
    tracks,
    visible_share,
)
from visup.rules.presence.step_context import PresenceSettings, Work

__all__ = ["PresenceSettings", "SeePresence", "visible_share"]


@dataclass(frozen=True, slots=True)
class SeePresence:
    """Reasoner of the cogitate phase: keeps who is there, tells who comes, goes, hides and shows.

    When no behaviour looked for regions in this step, nothing is concluded.
    """

    settings: PresenceSettings = field(default_factory=PresenceSettings)
    fragments: FragmentSettings = field(default_factory=FragmentSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Reasoner`."""
        if not observation.observed("region"):
            return Outcome(mind)
        old = tracks(mind)
        start = observation.time if old.start is None else old.start
        known = {i: t for i, t in old.of.items() if i in mind.objects}
        doubts: Mapping[int, Doubt] = mind.memory.get(FRAGMENTS, MappingProxyType({}))
        work = Work(mind, observation, known, doubts, self.settings)
        adopt(work)
        merge(work)
        _follow(work)
        starting = work.now - start <= self.settings.start_s
        work.doubts = Doubting(self.fragments)(doubts, work.mind, work.of, starting=starting)
        enter(work, start)
        show(work)
        miss(work)
        kept = {i: t for i, t in work.of.items() if i in work.mind.objects}
        told = {
            TRACKS: Tracks(start, MappingProxyType(kept)),
            FRAGMENTS: MappingProxyType(dict(work.doubts)),
        }
        memory = MappingProxyType({**work.mind.memory, **told})
        return Outcome(replace(work.mind, memory=memory), tuple(work.events))


def _follow(work: Work) -> None:
    seen = work.seen()
    around = _around(work)
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
            work.near(belief.region, other.region)
            for other in around
            if other.id != belief.id and not work.doubted(other, belief)
        )
        work.of[belief.id] = follow(
            track, belief.region, work.now, crowded, work.settings.allowed_gap_s
        )


def _around(work: Work) -> list[ObjectBelief]:
    """Objects that are seen, or were a flicker ago: all that may hide a part of another."""
    since = work.now - work.settings.allowed_gap_s
    return [b for b in work.mind.objects.values() if b.last_seen >= since]
