"""The coupling reasoner: when two objects become rigidly connected, and when they part (paper, section 5).

Two bodies are believed coupled when they have been at rest relative to each other for a while, and
- they touch, having approached each other before; or
- they touch and move together; or
- they have merged into one region that resembles the union of the two.
They are also believed coupled when one was at rest and starts to move while the other is the only moving body
that touches it (`carriers.py`).

Relative rest is decided by a sequential test (Wald 1945) on the relative velocity of both outlines
(`relative_motion.py`): each measurement adds log odds of rest against motion, until they suffice or fall to
0. A body that bounces off, whose relative velocity is zero for a moment, is therefore not taken for a
captured one, and clear rest is accepted early. Outlines that touch in the image may still be apart in depth;
while the depth of either is unknown, this cannot be distinguished from contact.
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
from visup.rules.coupling.carriers import CARRIERS, CarrierSettings, update_carriers
from visup.rules.coupling.contact import ContactSettings, OutlineContact, update_contact
from visup.rules.coupling.evidence import (
    CONFIDENCE,
    COUPLING,
    NO,
    NO_EVIDENCE,
    YES,
    Camera,
    CouplingEvidence,
    Pair,
    PairObservation,
    common_speed_nearby,
    coupling_cells,
    feet_of,
    move_alike,
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
from visup.rules.relations.samples import camera_motion
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
        relations: Thresholds, shared with the relations.
        near: Outline gap up to which the relative motion of a pair is tracked, image diagonals.
        window_s: Window over which relative velocity is measured, seconds; longer after a gap. Velocities
            within one window are correlated, and together count as one measurement.
        path_s: Length of the stored relative path, seconds.
        moving_speed: Typical relative speed of a pair that is not at rest, image diagonals per second.
        still_share: Relative speed that still counts as rest, as a share of the speed at which both move: an
            object that is carried sways and rotates, and errors of velocities grow with speed.
        moving_share: Typical relative speed of bodies that move independently, as a share of the same speed.
        rest_s: Least duration of relative rest, seconds, unless both move: a body that reverses rests for a
            moment, too.
        odds: Log odds of rest at which it is believed.
        carried_share: Share of `odds` that suffices while both move.
        outline_age_s: Age at which the stored outlines are replaced, seconds.
        approach_s: Longest time since the bodies approached each other for their rest to count, seconds.
        apart_s: How long a pair must be apart to be decoupled, seconds; `apart_path_limit` suffices as well.
        apart_path_limit: How far a pair must have moved apart to be decoupled, image diagonals.
        contact: When outlines that meet are in contact.
        carriers: When a body that starts to move counts as carried.
    """

    relations: RelationSettings = field(default_factory=RelationSettings)
    near: float = 0.012
    window_s: float = 0.3
    path_s: float = 1.2
    moving_speed: float = 0.0125
    still_share: float = 0.2
    moving_share: float = 1.0
    rest_s: float = 0.8
    odds: float = 5.0
    carried_share: float = 0.7
    outline_age_s: float = 2.5
    approach_s: float = 6.0
    apart_s: float = 0.35
    apart_path_limit: float = 0.012
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
            present = Condition("both are believed to be present", _both_present(pair, mind))
            yield ("coupled", pair), (present, _coupling_is(pair in coupled, False))
            yield ("decoupled", pair), (present, _coupling_is(pair in coupled, True))

    def _reason(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        old = mind.recall(COUPLING)
        coupled = {c.objects: c for c in mind.couplings}
        table = relation_table(mind)
        observed = observed_pairs(table, mind)
        touching, camera, s = touching_bodies(observed), camera_motion(observation), self.settings
        carriers = update_carriers(mind.recall(CARRIERS), touching, mind, s.carriers)
        carried = carriers.carried_since()
        new_evidence: dict[Pair, CouplingEvidence] = {}
        events: list[Event] = []
        for seen in observed:
            pair = seen.pair
            evidence = self._update_evidence(old.get(pair, NO_EVIDENCE), seen, mind, camera)
            start = carried.get(pair)
            if start is not None and evidence.was_decoupled_since(start):
                start = None
            if pair in coupled:
                if decide(self._may_decouple(evidence, mind), log, "decoupled", pair):
                    del coupled[pair]
                    text = "{0} and {1} {are} no longer coupled."
                    events.append(_event("decoupled", text, pair, mind, observation))
                    evidence = replace(NO_EVIDENCE, decoupled_at=mind.time)
            elif log is None and evidence.relative_track is None and start is None:
                pass  # fast path: far apart, as most pairs are, so that the first condition fails
            elif decide(self._may_couple(evidence, seen, mind, start), log, "coupled", pair):
                since = evidence.rest_since if start is None else start
                since = mind.time if since is None else since
                coupled[pair] = Coupling(pair, since)
                text = "{0} and {1} {are} coupled."
                events.append(_event("coupled", text, pair, mind, observation))
                evidence = replace(evidence, apart_since=None, decoupled_at=None)
            new_evidence[pair] = evidence
        remaining = tuple(c for pair, c in sorted(coupled.items()) if pair in new_evidence)
        cells = coupling_cells(observed, coupled, new_evidence, mind, s.contact)
        memory, table = MappingProxyType(new_evidence), table.with_block(cells)
        mind = mind.remember(COUPLING, memory, couplings=remaining, relations=table)
        mind = mind.remember(CARRIERS, carriers)
        # Parts of one machine are always connected, which is not worth an event.
        return Outcome(mind, tuple(e for e in events if not mind.one_machine(*e.objects)))

    def _update_evidence(
        self, before: CouplingEvidence, seen: PairObservation, mind: Mind, camera: Camera
    ) -> CouplingEvidence:
        """The evidence on a pair updated with one observation; `before` itself if nothing changes."""
        converging = seen.converging == YES and seen.touching != YES
        track = self._update_track(before.relative_track, seen, mind, camera)
        odds, contact, found = before.rest_odds, before.contact, None
        if track is not None and track is not before.relative_track:
            found = relative_velocity(track, mind.time, self.settings.window_s)
        if track is None or seen.touching != YES:
            odds = 0.0
        elif found is not None:
            odds = self._rest_odds(odds, before.relative_track, found, seen, mind)
        if seen.touching == YES:
            contact = self._update_contact(before, found, seen, mind)
        elif seen.touching == NO:
            contact = None
        far_apart = seen.diverging == YES or seen.gap > 0.02 * image_diagonal(mind.frame_size)
        apart = (seen.touching == NO and far_apart) or self._departs(contact, found, seen, mind)
        apart = apart and not move_alike(mind, seen.pair)
        unchanged = track is before.relative_track and odds == before.rest_odds and not converging
        unchanged = unchanged and contact is before.contact
        if unchanged and apart == (before.apart_since is not None):
            return before  # fast path, as most pairs are far apart
        converged = mind.time if converging else before.converged_at
        return CouplingEvidence(
            converged,
            odds,
            _since(before.rest_since, odds > 0.0, mind.time),
            _since(before.apart_since, apart, mind.time),
            self._path_apart(before, seen.pair, mind) if apart else 0.0,
            track,
            contact,
            before.decoupled_at,
        )

    def _path_apart(self, before: CouplingEvidence, pair: Pair, mind: Mind) -> float:
        """The relative path length of a pair since it came apart, pixels.

        It is no longer updated once the pair is too far apart to be tracked: so wide a gap may be a jump of
        an outline. Then only the time apart counts (`part_s`).
        """
        times = sample_window(mind).times
        dt = float(times[-1] - times[-2]) if len(times) > 1 else 0.0
        speed = float(np.nan_to_num(kinematics(mind).pair("relative_speed", *pair)))
        return before.apart_path + speed * dt

    def _update_track(
        self, before: RelativeTrack | None, seen: PairObservation, mind: Mind, camera: Camera
    ) -> RelativeTrack | None:
        """The updated relative track of a pair; None if it is not near, or has not been seen for long.

        The track stays as it was while either body is out of view.
        """
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
            outdated = before is None or mind.time - before.path_end > s.path_s / 2
            return None if outdated else before
        if not merged and not seen.gap <= s.near * image_diagonal(mind.frame_size):
            return None
        if before is None and merged:
            # Never seen side by side: the track starts from the last region of the hidden body and from the
            # merged region.
            return begin_relative_track(regions_apart(seen.pair, mind), mind.time, mind.frame_size)
        now, size, ages = mind.time, mind.frame_size, (s.path_s, s.outline_age_s)
        return update_relative_track(before, regions, now, size, ages, camera)

    def _rest_odds(
        self,
        odds: float,
        before: RelativeTrack | None,
        relative: RelativeVelocity,
        seen: PairObservation,
        mind: Mind,
    ) -> float:
        """The log odds of relative rest, at least 0, updated with a relative velocity.

        Args:
            odds: Log odds before.
            before: The relative track before this observation, if any.
            relative: The relative velocity measured now.
            seen: The observation of the pair.
            mind: The mind.
        """
        s, elapsed = self.settings, mind.time - (before.path_end if before else mind.time)
        diagonal = image_diagonal(mind.frame_size)
        shared_speed = common_speed_nearby(mind, seen.pair, before, relative)
        still = max(s.relations.still_speed * diagonal, s.still_share * shared_speed)
        moving = max(s.moving_speed * diagonal, s.moving_share * shared_speed)
        log_odds = relative.rest_odds(still, moving)
        log_odds *= min(1.0, elapsed / relative.span)
        # Capped, since higher odds would only delay a change to the opposite belief.
        return min(max(0.0, odds + log_odds), 2 * s.odds)

    def _update_contact(
        self,
        before: CouplingEvidence,
        found: RelativeVelocity | None,
        seen: PairObservation,
        mind: Mind,
    ) -> OutlineContact:
        """The updated contact of two outlines that meet: whether one passes the other."""
        s, track = self.settings.contact, before.relative_track
        shared = s.passing_share * common_speed_nearby(mind, seen.pair, track, found)
        limit = max(s.passing * image_diagonal(mind.frame_size), shared)
        speed = None if found is None else float(np.hypot(*found.velocity))
        dt = mind.time - track.path_end if track is not None else 0.0
        moment, crossed = (mind.time, dt), before.contact.path if before.contact else 0.0
        least = s.doubt_share * smaller_size(seen.pair, mind)
        thrown_back = seen.diverging == YES and crossed < least
        sigma = math.inf if found is None else found.speed_sigma
        feet = feet_of(seen, mind)
        return update_contact(
            before.contact, speed, limit, moment, s, sigma=sigma, thrown_back=thrown_back, feet=feet
        )

    def _departs(
        self,
        contact: OutlineContact | None,
        found: RelativeVelocity | None,
        seen: PairObservation,
        mind: Mind,
    ) -> bool:
        """Whether one body moves away while the other is nearly at rest, though they are still near."""
        s, diagonal, now = self.settings, image_diagonal(mind.frame_size), kinematics(mind)
        speed = 0.0 if found is None else float(np.hypot(*found.velocity))
        if seen.gap > s.near * diagonal:  # no longer tracked, but they may count as touching
            speed = float(np.nan_to_num(now.pair("relative_speed", *seen.pair)))
        passing = contact is not None and contact.passing
        known = contact is not None or seen.touching == NO
        if not known or not (passing or speed > s.contact.passing * diagonal):
            return False
        least = max(s.relations.still_speed * diagonal, s.still_share * speed)
        return any(now.one("speed", i) < least for i in seen.pair)

    def _may_couple(
        self,
        evidence: CouplingEvidence,
        seen: PairObservation,
        mind: Mind,
        carried_since: float | None,
    ) -> Iterator[Condition]:
        """Conditions of a pair becoming coupled.

        Args:
            evidence: Evidence on the pair.
            seen: The observation of the pair.
            mind: The mind.
            carried_since: Time when one of them started to move, carried by the other, seconds; None if not
                so.
        """
        if carried_since is not None:
            yield Condition("one rested and set out while the other alone moved it", True)
            return
        s, track = self.settings, evidence.relative_track
        tracked = track is not None and track.path_end == mind.time
        yield Condition("both are seen near each other", tracked)
        in_front = evidence.contact is not None and evidence.contact.in_front
        yield Condition("neither has come down in front of the other", not in_front)
        text = "log odds that they touch and are at rest"
        together = mind.truth("moving_together", *seen.pair) is Truth.TRUE
        least = 2.0 * s.relations.still_speed * image_diagonal(mind.frame_size)
        relative = None if track is None else relative_velocity(track, mind.time, s.window_s)
        moving = common_speed_nearby(mind, seen.pair, track, relative) > least
        # `moving_together` was established over a window of its own, so that less evidence suffices.
        share = 0.4 if together else s.carried_share if moving else 1.0
        yield at_least(text, evidence.rest_odds, share * s.odds)
        if not (moving or together) and evidence.rest_since is not None:
            lasted = mind.time - evidence.rest_since
            yield at_least("at rest for", lasted, s.rest_s, " s", slack=1e-6)
        if seen.host is not None or together:
            return
        if moving:
            return  # at rest relative to each other while both move: they move as one
        at = evidence.converged_at
        if at is None:
            yield Condition("they have come together, move together, or share a region", False)
        else:
            text = "since they came together"
            ago = mind.time - at
            yield Condition(text, ago <= s.approach_s, ago, s.approach_s, " s", below=True)

    def _may_decouple(self, evidence: CouplingEvidence, mind: Mind) -> Iterator[Condition]:
        """Conditions of a pair being no longer coupled."""
        yield Condition("they are apart", evidence.apart_since is not None)
        if evidence.apart_since is not None:
            least = self.settings.apart_path_limit * image_diagonal(mind.frame_size)
            if evidence.apart_path >= least:
                return
            lasted = mind.time - evidence.apart_since
            yield at_least("apart for", lasted, self.settings.apart_s, " s", slack=1e-6)


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
