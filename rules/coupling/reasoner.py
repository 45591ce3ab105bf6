"""Physical connection: when two objects become one body, and when they part (paper, section 5).

Two bodies are believed coupled when, for a while, they are at rest to each other, and
- they touch, and came together before that; or
- they touch and move together; or
- the number of regions fell, and the region that is left is like the union of the two.

Rest is judged by how both outlines move relative to each other (`relative_motion.py`), in a sequential
test: each velocity gives odds of rest against motion, and these add up until they suffice (Wald 1945)
or are lost. A body that bounces off, whose relative velocity is zero for a moment, is so not taken for
one that was caught, and one that clearly rests is not waited for. Outlines that touch in the image may still
be apart in space: with the depth of one of the two unknown this is not told apart from contact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from visup.agent import (
    Column,
    Coupling,
    Event,
    Mind,
    Observation,
    Outcome,
    Presence,
    Region,
    RelationTable,
    Truth,
)
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.agent.model.relation_columns import UNKNOWN_CODE, ColumnLayout, RelationBlock
from visup.rules.coupling.relative_motion import (
    RelativeTrack,
    begin_relative_track,
    relative_velocity,
    update_relative_track,
)
from visup.rules.geometry.regions import image_diagonal
from visup.rules.presence.object_tracks import merged_pairs
from visup.rules.relations.kinematics import RelationSettings
from visup.rules.relations.reasoner import kinematics
from visup.rules.wording.conditions import Condition, DecisionLog, at_least, decide
from visup.rules.wording.sentences import sentence

CONFIDENCE = 0.9
"""How sure couplings are: outlines at rest to each other may still be apart in depth."""

COLUMNS = ColumnLayout((Column(("", "coupled"), (0, 0), 0),))

YES, MAYBE, NO = 1, 0, -1
"""Codes of truths."""

Pair = tuple[int, int]


@dataclass(frozen=True, slots=True)
class CouplingSettings:
    """When two bodies count as one.

    Attributes:
        relations: Thresholds; those of the relations.
        near: Gap from which on two bodies are followed, image diagonals.
        window_s: Over how long a relative velocity is taken, or longer after a gap; those of one window
            count as one.
        path_s: How far back their relative path is kept.
        moving: Usual relative speed of bodies that are not at rest, image diagonals per second.
        odds: Logarithm of the odds of rest from which on it is believed.
        anew_s: Outlines that are compared are no older than this.
        approach_s: How long ago bodies may have come together for their rest to count.
        part_s: How long they must be apart before they are decoupled.
    """

    relations: RelationSettings = field(default_factory=RelationSettings)
    near: float = 0.012
    window_s: float = 0.3
    path_s: float = 1.2
    moving: float = 0.0125
    odds: float = 5.0
    anew_s: float = 2.5
    approach_s: float = 6.0
    part_s: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class CouplingEvidence:
    """What is remembered of one pair: seconds since when each holds, or None.

    Attributes:
        converged_at: When they last were converging, not touching yet.
        rest_odds: Logarithm of the odds, from 0 on, that they touch and are at rest.
        apart_since: Since when they are apart.
        relative_track: How they have moved relative to each other since they are near.
    """

    converged_at: float | None = None
    rest_odds: float = 0.0
    apart_since: float | None = None
    relative_track: RelativeTrack | None = None


COUPLING: MemoryKey[Mapping[Pair, CouplingEvidence]] = MemoryKey(
    "rules.coupling", MappingProxyType({})
)


NO_EVIDENCE = CouplingEvidence()


class PairObservation(NamedTuple):
    """Two objects as they are seen now; lives only while the reasoner runs.

    Attributes:
        pair: Their ids.
        touching: Code of a truth, and
        converging: the same, and
        diverging: the same.
        gap: Of their outlines, pixels; NaN unknown.
        host: Id of the one in whose region both are merged, or None.
    """

    pair: Pair
    touching: int
    converging: int
    diverging: int
    gap: float
    host: int | None


@dataclass(frozen=True, slots=True)
class CouplingReasoner:
    """Reasoner of the cogitate phase, after the relations: couplings and the `coupled` relation."""

    settings: CouplingSettings = field(default_factory=CouplingSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Reasoner`."""
        return self._judged(mind, observation, None)

    def explain(self, mind: Mind, observation: Observation) -> DecisionLog:
        """What the decisions 'coupled' and 'decoupled' of a step hang on, for every pair.

        Args:
            mind: As this reasoner got it in that step.
            observation: What was perceived.
        """
        log = DecisionLog()
        self._judged(mind, observation, log)
        coupled = {c.objects for c in mind.couplings}
        for pair in combinations(sorted(mind.objects), 2):
            there = Condition("both are believed to be there", _both_present(pair, mind))
            log.setdefault(("coupled", pair), (there, _coupling_is(pair in coupled, False)))
            log.setdefault(("decoupled", pair), (there, _coupling_is(pair in coupled, True)))
        return log

    def _judged(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        old = mind.recall(COUPLING)
        coupled = {c.objects: c for c in mind.couplings}
        table = _table(mind)
        observed = _observed_pairs(table, mind)
        kept: dict[Pair, CouplingEvidence] = {}
        events: list[Event] = []
        for seen in observed:
            pair = seen.pair
            evidence = self._look(old.get(pair, NO_EVIDENCE), seen, mind)
            if pair in coupled:
                if decide(self._decoupling(evidence, mind), log, "decoupled", pair):
                    del coupled[pair]
                    text = "{0} and {1} {are} no longer coupled."
                    events.append(_event("decoupled", text, pair, mind, observation))
                    evidence = NO_EVIDENCE
            elif log is None and evidence.relative_track is None:
                pass  # as nearly always: they are not near each other; the first condition
            elif decide(self._coupling(evidence, seen, mind), log, "coupled", pair):
                coupled[pair] = Coupling(pair, mind.time)
                text = "{0} and {1} {are} coupled."
                events.append(_event("coupled", text, pair, mind, observation))
                evidence = replace(evidence, apart_since=None)
            kept[pair] = evidence
        alive = tuple(c for pair, c in sorted(coupled.items()) if pair in kept)
        table = table.with_block(_coupled_cells(observed, coupled, mind))
        memory = MappingProxyType(kept)
        mind = mind.remember(COUPLING, memory, couplings=alive, relations=table)
        # That parts of one machine hang together is no news.
        return Outcome(mind, tuple(e for e in events if not mind.one_machine(*e.objects)))

    def _look(
        self, before: CouplingEvidence, seen: PairObservation, mind: Mind
    ) -> CouplingEvidence:
        converging = seen.converging == YES and seen.touching != YES
        far = seen.diverging == YES or seen.gap > 0.02 * image_diagonal(mind.frame_size)
        apart = seen.touching == NO and far
        track = self._follow(before.relative_track, seen, mind)
        odds = before.rest_odds
        if track is None or seen.touching != YES:
            odds = 0.0
        elif track is not before.relative_track:
            odds = self._rest(odds, before.relative_track, track, mind)
        same = track is before.relative_track and odds == before.rest_odds and not converging
        if same and apart == (before.apart_since is not None):
            return before  # as nearly always: most pairs are far from each other
        converged = mind.time if converging else before.converged_at
        return CouplingEvidence(
            converged, odds, _since(before.apart_since, apart, mind.time), track
        )

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
        regions = _regions(seen, mind)
        if regions is None:
            old = before is None or mind.time - before.path_end > s.path_s / 2
            return None if old else before
        if not merged and not seen.gap <= s.near * image_diagonal(mind.frame_size):
            return None
        if before is None and merged:
            # Not seen side by side before: one is followed as it was last seen, the other with it.
            return begin_relative_track(_apart(seen.pair, mind), mind.time, mind.frame_size)
        return update_relative_track(
            before, regions, mind.time, mind.frame_size, lasts_s=s.path_s, anew_s=s.anew_s
        )

    def _rest(
        self, odds: float, before: RelativeTrack | None, track: RelativeTrack, mind: Mind
    ) -> float:
        """The odds of rest after another sight of both."""
        s, waited = self.settings, mind.time - (before.path_end if before else mind.time)
        found = relative_velocity(track, mind.time, s.window_s)
        if found is None:
            return odds
        diagonal = image_diagonal(mind.frame_size)
        told = found.rest_odds(s.relations.still_speed * diagonal, s.moving * diagonal)
        told *= min(1.0, waited / found.span)
        # Odds beyond the bound would only delay that the opposite is believed.
        return min(max(0.0, odds + told), 2 * s.odds)

    def _coupling(
        self, evidence: CouplingEvidence, seen: PairObservation, mind: Mind
    ) -> Iterator[Condition]:
        """Conditions of two becoming one body."""
        s, track = self.settings, evidence.relative_track
        watched = track is not None and track.path_end == mind.time
        yield Condition("both are seen near each other", watched)
        text = "log odds that they touch and are at rest"
        yield at_least(text, evidence.rest_odds, s.odds)
        if seen.host is not None or mind.truth("moving_together", *seen.pair) is Truth.TRUE:
            return
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
            lasted = mind.time - evidence.apart_since
            yield at_least("apart for", lasted, self.settings.part_s, " s", slack=1e-6)


def _both_present(pair: Pair, mind: Mind) -> bool:
    return set(pair) <= {b.id for b in mind.present()}


def _coupling_is(coupled: bool, wanted: bool) -> Condition:
    return Condition("they are coupled" if wanted else "they are not coupled", coupled is wanted)


def _observed_pairs(table: RelationTable, mind: Mind) -> list[PairObservation]:
    """All pairs of present objects as they are seen now."""
    ids, now = table.ids, kinematics(mind)
    hosts = {(min(pair), max(pair)): pair[1] for pair in merged_pairs(mind)}
    gaps = now.gap.tolist() if now.ids == ids else None
    told = zip(*map(table.codes, ("touching", "converging", "diverging")), strict=True)
    observed = []
    for i, a in enumerate(ids):
        for j in range(i + 1, len(ids)):
            b = ids[j]
            gap = gaps[i][j] if gaps else now.pair("gap", a, b)
            touching, closing, parting = next(told)
            host = hosts.get((a, b))
            observed.append(PairObservation((a, b), touching, closing, parting, gap, host))
    return observed


def _table(mind: Mind) -> RelationTable:
    """The relations of all present objects."""
    ids, table = tuple([b.id for b in mind.present()]), mind.relations
    if isinstance(table, RelationTable) and table.ids == ids:
        return table
    return RelationTable(ids, extra=tuple(table))


def _coupled_cells(
    observed: Sequence[PairObservation], coupled: Mapping[Pair, Coupling], mind: Mind
) -> RelationBlock:
    """The relation of being coupled."""
    hidden = {i for i, b in mind.objects.items() if b.presence is not Presence.SEEN}
    state, since = [0] * len(observed), [mind.time] * len(observed)
    for k, seen in enumerate(observed):
        if seen.pair in coupled:
            state[k], since[k] = 1, coupled[seen.pair].since
        elif seen.touching == MAYBE or (hidden and not hidden.isdisjoint(seen.pair)):
            state[k] = UNKNOWN_CODE
    sure = np.full((1, len(observed)), CONFIDENCE)
    return RelationBlock(COLUMNS, np.array([state], dtype=np.int8), np.array([since]), sure)


def _regions(seen: PairObservation, mind: Mind) -> tuple[Region, Region] | None:
    """The regions in which the two are seen now, twice the same one when they are merged."""
    if seen.host is not None:
        host = mind.objects[seen.host]
        return (host.region, host.region) if host.last_seen == mind.time else None
    first, second = (mind.objects[i] for i in seen.pair)
    if first.last_seen < mind.time or second.last_seen < mind.time:
        return None
    return first.region, second.region


def _apart(pair: Pair, mind: Mind) -> tuple[Region, Region]:
    """The regions of two that are merged: what was last seen of the one, and the merged one."""
    first, second = (mind.objects[i].region for i in pair)
    return first, second


def _since(before: float | None, holds: bool, now: float) -> float | None:
    if not holds:
        return None
    return now if before is None else before


def _event(kind: str, template: str, pair: Pair, mind: Mind, observation: Observation) -> Event:
    text = sentence(mind, template, *pair, confidence=CONFIDENCE)
    return Event(kind, observation.time, observation.frame_index, text, pair, CONFIDENCE)
