"""Physical connection: when two objects become one body, and when they part (paper, section 5).

Two bodies are believed coupled when, for a while, they are at rest to each other, and
- they touch, and came together before that; or
- they touch and move together; or
- the number of regions fell, and the region that is left is like the union of the two.
Or when one of them rested and set out while the other alone, of those that move, touches it (`carriers.py`).

Rest is judged by how both outlines move relative to each other (`relative_motion.py`), in a sequential
test: each velocity gives odds of rest against motion, and these add up until they suffice (Wald 1945)
or are lost. A body that bounces off, whose relative velocity is zero for a moment, is so not taken for
one that was caught, and one that clearly rests is not waited for. Outlines that touch in the image may still
be apart in space: with the depth of one of the two unknown this is not told apart from contact.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations
from types import MappingProxyType

import numpy as np

from visup.agent import (
    Coupling,
    Event,
    Mind,
    Observation,
    Outcome,
    Truth,
)
from visup.agent.model.fast_replace import replace
from visup.rules.coupling.carriers import CARRIERS, CarrierSettings, updated_carriers
from visup.rules.coupling.contact import ContactSettings, OutlineContact, updated_contact
from visup.rules.coupling.evidence import (
    CONFIDENCE,
    COUPLING,
    NO,
    NO_EVIDENCE,
    YES,
    CouplingEvidence,
    Pair,
    PairObservation,
    common_speed,
    coupling_cells,
    feet_of,
    goes_along,
    observed_pairs,
    pair_regions,
    regions_apart,
    relation_table,
    smaller_size,
    touching_bodies,
)
from visup.rules.coupling.relative_motion import (
    RelativeTrack,
    RelativeVelocity,
    begin_relative_track,
    relative_velocity,
    update_relative_track,
)
from visup.rules.geometry.regions import image_diagonal
from visup.rules.relations.kinematics import RelationSettings
from visup.rules.relations.reasoner import kinematics, sample_window
from visup.rules.wording.conditions import (
    Condition,
    DecisionLog,
    ExplainableReasoner,
    Subject,
    at_least,
    decide,
)
from visup.rules.wording.sentences import sentence


@dataclass(frozen=True, slots=True)
class CouplingSettings:
    """When two bodies count as one.

    Attributes:
        relations: Thresholds; those of the relations.
        near: Gap from which on two bodies are followed, image diagonals.
        window_s: Window of a relative velocity, longer after a gap; those of one window count as one.
        path_s: Length of the stored relative path, seconds.
        moving: Usual relative speed of bodies that are not at rest, image diagonals per second.
        still_share: Relative speed that still is rest, as a share of the speed at which both move: what is
            carried sways and turns, and errors of velocities grow with these; and
        moving_share: usual relative speed of bodies that move each by itself, as such a share.
        rest_s: For how long they must be at rest, where they do not move: what turns back rests, too.
        odds: Logarithm of the odds of rest from which on it is believed.
        carried_share: The same as a share, where both are on the move.
        anew_s: Outlines that are compared are no older than this.
        approach_s: How long ago bodies may have come together for their rest to count.
        part_s: How long they must be apart before they are decoupled; or
        part_path: how far they must have moved apart while they were followed, image diagonals.
        contact: When outlines that meet are in contact.
        carriers: When a body that sets out counts as carried.
    """

    relations: RelationSettings = field(default_factory=RelationSettings)
    near: float = 0.012
    window_s: float = 0.3
    path_s: float = 1.2
    moving: float = 0.0125
    still_share: float = 0.2
    moving_share: float = 1.0
    rest_s: float = 0.8
    odds: float = 5.0
    carried_share: float = 0.7
    anew_s: float = 2.5
    approach_s: float = 6.0
    part_s: float = 0.35
    part_path: float = 0.012
    contact: ContactSettings = field(default_factory=ContactSettings)
    carriers: CarrierSettings = field(default_factory=CarrierSettings)


@dataclass(frozen=True, slots=True)
class CouplingReasoner(ExplainableReasoner):
    """Reasoner of the cogitate phase, after the relations: couplings and the `coupled` relation.

    It explains the decisions 'coupled' and 'decoupled' for every pair.
    """

    settings: CouplingSettings = field(default_factory=CouplingSettings)

    def _preconditions(
        self, mind: Mind, after: Mind, observation: Observation
    ) -> Iterator[tuple[Subject, tuple[Condition, ...]]]:
        coupled = {c.objects for c in mind.couplings}
        for pair in combinations(sorted(mind.objects), 2):
            there = Condition("both are believed to be present", _both_present(pair, mind))
            yield ("coupled", pair), (there, _coupling_is(pair in coupled, False))
            yield ("decoupled", pair), (there, _coupling_is(pair in coupled, True))

    def _reason(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        old = mind.recall(COUPLING)
        coupled = {c.objects: c for c in mind.couplings}
        table = relation_table(mind)
        observed = observed_pairs(table, mind)
        carriers = updated_carriers(
            mind.recall(CARRIERS), touching_bodies(observed), mind, self.settings.carriers
        )
        carried = carriers.carried()
        kept: dict[Pair, CouplingEvidence] = {}
        events: list[Event] = []
        for seen in observed:
            pair = seen.pair
            evidence = self._look(old.get(pair, NO_EVIDENCE), seen, mind)
            set_out = carried.get(pair)
            if set_out is not None and evidence.parted_since(set_out):
                set_out = None
            if pair in coupled:
                if decide(self._decoupling(evidence, mind), log, "decoupled", pair):
                    del coupled[pair]
                    text = "{0} and {1} {are} no longer coupled."
                    events.append(_event("decoupled", text, pair, mind, observation))
                    evidence = replace(NO_EVIDENCE, decoupled_at=mind.time)
            elif log is None and evidence.relative_track is None and set_out is None:
                pass  # as nearly always: they are not near each other; the first condition
            elif decide(self._coupling(evidence, seen, mind, set_out), log, "coupled", pair):
                since = evidence.rest_since if set_out is None else set_out
                since = mind.time if since is None else since
                coupled[pair] = Coupling(pair, since)
                text = "{0} and {1} {are} coupled."
                events.append(_event("coupled", text, pair, mind, observation))
                evidence = replace(evidence, apart_since=None, decoupled_at=None)
            kept[pair] = evidence
        alive = tuple(c for pair, c in sorted(coupled.items()) if pair in kept)
        table = table.with_block(coupling_cells(observed, coupled, kept, mind))
        memory = MappingProxyType(kept)
        mind = mind.remember(COUPLING, memory, couplings=alive, relations=table)
        mind = mind.remember(CARRIERS, carriers)
        # That parts of one machine hang together is no news.
        return Outcome(mind, tuple(e for e in events if not mind.one_machine(*e.objects)))

    def _look(
        self, before: CouplingEvidence, seen: PairObservation, mind: Mind
    ) -> CouplingEvidence:
        converging = seen.converging == YES and seen.touching != YES
        track = self._follow(before.relative_track, seen, mind)
        odds, contact, found = before.rest_odds, before.contact, None
        if track is not None and track is not before.relative_track:
            found = relative_velocity(track, mind.time, self.settings.window_s)
        if track is None or seen.touching != YES:
            odds = 0.0
        elif found is not None:
            odds = self._rest(odds, before.relative_track, found, seen, mind)
        if seen.touching == YES:
            contact = self._contact(before, found, seen, mind)
        elif seen.touching == NO:
            contact = None
        far = seen.diverging == YES or seen.gap > 0.02 * image_diagonal(mind.frame_size)
        apart = (seen.touching == NO and far) or self._leaves(contact, found, seen, mind)
        apart = apart and not goes_along(mind, seen.pair)
        same = track is before.relative_track and odds == before.rest_odds and not converging
        same = same and contact is before.contact
        if same and apart == (before.apart_since is not None):
            return before  # as nearly always: most pairs are far from each other
        converged = mind.time if converging else before.converged_at
        return CouplingEvidence(
            converged,
            odds,
            _since(before.rest_since, odds > 0.0, mind.time),
            _since(before.apart_since, apart, mind.time),
            self._parted(before, seen.pair, mind) if apart else 0.0,
            track,
            contact,
            before.decoupled_at,
        )

    def _parted(self, before: CouplingEvidence, pair: Pair, mind: Mind) -> float:
        """How far two that are apart have moved relative to each other since, pixels.

        Once they are followed no longer it stands still, and only the time counts: beyond that a gap may
        just as well be an outline that has leapt.
        """
        times = sample_window(mind).times
        lasted = float(times[-1] - times[-2]) if len(times) > 1 else 0.0
        speed = float(np.nan_to_num(kinematics(mind).pair("relative_speed", *pair)))
        return before.apart_path + speed * lasted

    def _follow(
        self, before: RelativeTrack | None, seen: PairObservation, mind: Mind
    ) -> RelativeTrack | None:
        """How the two move relative to each other; the same as before when they are not seen."""
        s = self.settings
        merged = seen.host is not None
        if (
            before is None
            and not merged
            and not seen.gap <= s.near * image_diagonal(mind.frame_size)
        ):
            return None
        regions = pair_regions(seen, mind)
        if regions is None:
            old = before is None or mind.time - before.path_end > s.path_s / 2
            return None if old else before
        if not merged and not seen.gap <= s.near * image_diagonal(mind.frame_size):
            return None
        if before is None and merged:
            # Not seen side by side before: one is followed as it was last seen, the other with it.
            return begin_relative_track(regions_apart(seen.pair, mind), mind.time, mind.frame_size)
        return update_relative_track(
            before, regions, mind.time, mind.frame_size, lasts_s=s.path_s, anew_s=s.anew_s
        )

    def _rest(
        self,
        odds: float,
        before: RelativeTrack | None,
        found: RelativeVelocity,
        seen: PairObservation,
        mind: Mind,
    ) -> float:
        """The odds of rest after another sight of both."""
        s, waited = self.settings, mind.time - (before.path_end if before else mind.time)
        diagonal = image_diagonal(mind.frame_size)
        both = common_speed(mind, seen.pair)
        still = max(s.relations.still_speed * diagonal, s.still_share * both)
        told = found.rest_odds(still, max(s.moving * diagonal, s.moving_share * both))
        told *= min(1.0, waited / found.span)
        # Odds beyond the bound would only delay that the opposite is believed.
        return min(max(0.0, odds + told), 2 * s.odds)

    def _contact(
        self,
        before: CouplingEvidence,
        found: RelativeVelocity | None,
        seen: PairObservation,
        mind: Mind,
    ) -> OutlineContact:
        """Two whose outlines meet: whether one goes past the other."""
        s, track = self.settings.contact, before.relative_track
        limit = s.passing * image_diagonal(mind.frame_size)
        limit = max(limit, s.passing_share * common_speed(mind, seen.pair))
        speed = None if found is None else float(np.hypot(*found.velocity))
        dt = mind.time - track.path_end if track is not None else 0.0
        moment, crossed = (mind.time, dt), before.contact.path if before.contact else 0.0
        least = s.doubt_share * smaller_size(seen.pair, mind)
        back = seen.diverging == YES and crossed < least
        sigma = math.inf if found is None else found.speed_sigma
        feet = feet_of(seen, mind)
        return updated_contact(
            before.contact, speed, limit, moment, s, sigma=sigma, thrown_back=back, feet=feet
        )

    def _leaves(
        self,
        contact: OutlineContact | None,
        found: RelativeVelocity | None,
        seen: PairObservation,
        mind: Mind,
    ) -> bool:
        """Whether one of two moves on, while the other all but rests, though they are still near."""
        s, diagonal, now = self.settings, image_diagonal(mind.frame_size), kinematics(mind)
        speed = 0.0 if found is None else float(np.hypot(*found.velocity))
        if seen.gap > s.near * diagonal:  # no longer followed, though they may still seem to touch
            speed = float(np.nan_to_num(now.pair("relative_speed", *seen.pair)))
        passing = contact is not None and contact.passing
        known = contact is not None or seen.touching == NO
        if not known or not (passing or speed > s.contact.passing * diagonal):
            return False
        least = max(s.relations.still_speed * diagonal, s.still_share * speed)
        return any(now.one("speed", i) < least for i in seen.pair)

    def _coupling(
        self,
        evidence: CouplingEvidence,
        seen: PairObservation,
        mind: Mind,
        set_out: float | None,
    ) -> Iterator[Condition]:
        """Conditions of two becoming one body; `set_out`: when one did that the other carries, if so."""
        if set_out is not None:
            yield Condition("one rested and set out while the other alone moved it", True)
            return
        s, track = self.settings, evidence.relative_track
        watched = track is not None and track.path_end == mind.time
        yield Condition("both are seen near each other", watched)
        front = evidence.contact is not None and evidence.contact.in_front
        yield Condition("neither has come down in front of the other", not front)
        text = "log odds that they touch and are at rest"
        together = mind.truth("moving_together", *seen.pair) is Truth.TRUE
        least = 2.0 * s.relations.still_speed * image_diagonal(mind.frame_size)
        moving = common_speed(mind, seen.pair) > least
        # Moving together was judged over its own window, and is hardly ever relative rest by chance.
        share = 0.4 if together else s.carried_share if moving else 1.0
        yield at_least(text, evidence.rest_odds, share * s.odds)
        if not (moving or together) and evidence.rest_since is not None:
            lasted = mind.time - evidence.rest_since
            yield at_least("at rest for", lasted, s.rest_s, " s", slack=1e-6)
        if seen.host is not None or together:
            return
        if moving:
            return  # at rest to each other, and on the move: as one
        at = evidence.converged_at
        if at is None:
            yield Condition("they have come together, move together, or share a region", False)
        else:
            text = "since they came together"
            ago = mind.time - at
            yield Condition(text, ago <= s.approach_s, ago, s.approach_s, " s", below=True)

    def _decoupling(self, evidence: CouplingEvidence, mind: Mind) -> Iterator[Condition]:
        """Conditions of two no longer being one body."""
        yield Condition("they are apart", evidence.apart_since is not None)
        if evidence.apart_since is not None:
            least = self.settings.part_path * image_diagonal(mind.frame_size)
            if evidence.apart_path >= least:
                return
            lasted = mind.time - evidence.apart_since
            yield at_least("apart for", lasted, self.settings.part_s, " s", slack=1e-6)


def _both_present(pair: Pair, mind: Mind) -> bool:
    return set(pair) <= {b.id for b in mind.present()}


def _coupling_is(coupled: bool, wanted: bool) -> Condition:
    return Condition("they are coupled" if wanted else "they are not coupled", coupled is wanted)


def _since(before: float | None, holds: bool, now: float) -> float | None:
    if not holds:
        return None
    return now if before is None else before


def _event(kind: str, template: str, pair: Pair, mind: Mind, observation: Observation) -> Event:
    text = sentence(mind, template, *pair, confidence=CONFIDENCE)
    return Event(kind, observation.time, observation.frame_index, text, pair, CONFIDENCE)
