"""Physical connection: when two objects become one body, and when they part (paper, section 5).

Two bodies are believed coupled when, for a while,
- they touch, came together before that, and are now at rest to each other; or
- they touch and move together rigidly; or
- the number of regions fell, the region that is left is like the union of the two, and it keeps
  that shape.

Rest and rigid motion are judged by the velocities of both outlines in the two halves of the last
second, so that a body that bounces off (whose mean relative velocity is zero for a moment) is not
taken for one that was caught. Outlines that touch in the image may still be apart in space: with
the depth of one of the two unknown this is not told apart from contact.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from visup.agent import (
    Coupling,
    Event,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Presence,
    Region,
    Relation,
    Truth,
)
from visup.rules.measure import Measured, RelationSettings, at_rest, scale
from visup.rules.relations import measured
from visup.rules.rigid import shape_change
from visup.rules.sentences import sentence
from visup.rules.tracks import merged_pairs

COUPLING = "rules.coupling"
Pair = tuple[int, int]
Held = Mapping[tuple[str, tuple[int, ...]], Truth]


@dataclass(frozen=True, slots=True)
class CouplingSettings:
    """When two bodies count as one.

    Attributes:
        relations: Thresholds of rest; those of the relations.
        rest_s: How long rest must last, beyond the window over which it is judged.
        merged_s: How long a merged region must keep its shape.
        merged_lag_s: How far apart the shapes are that are compared.
        merged_change: Share of the area that may differ.
        approach_s: How long ago bodies may have come together for their rest to count.
        part_s: How long they must be apart before they are decoupled.
    """

    relations: RelationSettings = field(default_factory=RelationSettings)
    rest_s: float = 0.08
    merged_s: float = 0.9
    merged_lag_s: float = 1.0
    merged_change: float = 0.025
    approach_s: float = 6.0
    part_s: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Pending:
    """What is remembered of one pair: seconds since when each holds, or None.

    Attributes:
        converged_at: When they last were converging.
        rest_since: Since when they touch and are at rest.
        apart_since: Since when they are apart.
        shapes: (time, region) of the region in which they are merged, at most six.
        rigid_since: Since when that region keeps its shape.
    """

    converged_at: float | None = None
    rest_since: float | None = None
    apart_since: float | None = None
    shapes: tuple[tuple[float, Region], ...] = ()
    rigid_since: float | None = None


@dataclass(frozen=True, slots=True)
class Couple:
    """Thinker of the cogitate phase, after the relations: couplings and the `coupled` relation."""

    settings: CouplingSettings = field(default_factory=CouplingSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        old: Mapping[Pair, Pending] = mind.memory.get(COUPLING, MappingProxyType({}))
        coupled = {c.objects: c for c in mind.couplings}
        objects = mind.present()
        pairs = [(a.id, b.id) for i, a in enumerate(objects) for b in objects[i + 1 :]]
        held: Held = {
            (name, pair): r.truth
            for pair in pairs
            for name in ("touching", "converging", "diverging")
            if (r := mind.relation(name, *pair)) is not None
        }
        now = measured(mind)
        kept: dict[Pair, Pending] = {}
        events: list[Event] = []
        for pair in pairs:
            p = self._look(old.get(pair, Pending()), pair, held, now, mind)
            if pair not in coupled and self._joined(p, pair, mind):
                coupled[pair] = Coupling(pair, mind.time)
                events.append(
                    _event("coupled", "{0} and {1} are coupled.", pair, mind, observation)
                )
                p = replace(p, apart_since=None)
            elif pair in coupled and _lasts(p.apart_since, self.settings.part_s, mind.time):
                del coupled[pair]
                text = "{0} and {1} are no longer coupled."
                events.append(_event("decoupled", text, pair, mind, observation))
                p = Pending()
            kept[pair] = p
        alive = tuple(c for pair, c in sorted(coupled.items()) if pair in kept)
        told = tuple(self._relation(pair, coupled.get(pair), held, mind) for pair in pairs)
        mind = replace(mind, couplings=alive, relations=mind.relations + told)
        return Outcome(mind.remember(COUPLING, MappingProxyType(kept)), tuple(events))

    def _look(
        self,
        before: Pending,
        pair: Pair,
        held: Held,
        now: Measured,
        mind: Mind,
    ) -> Pending:
        touching = held.get(("touching", pair), Truth.UNKNOWN)
        converging = held.get(("converging", pair)) is Truth.TRUE
        rest = touching is Truth.TRUE and self._at_rest(now, pair, mind)
        apart = touching is Truth.FALSE and held.get(("diverging", pair)) is Truth.TRUE
        apart = apart or (touching is Truth.FALSE and self._well_apart(now, pair, mind))
        return Pending(
            mind.time if converging else before.converged_at,
            _since(before.rest_since, rest, mind.time),
            _since(before.apart_since, apart, mind.time),
            *self._shapes(before, pair, mind),
        )

    def _shapes(
        self, before: Pending, pair: Pair, mind: Mind
    ) -> tuple[tuple[tuple[float, Region], ...], float | None]:
        """Shapes of the merged region, four a second, and since when they are alike."""
        s, now = self.settings, mind.time
        host = _host(pair, mind)
        shapes = tuple(x for x in before.shapes if now - x[0] <= s.merged_lag_s + 0.3)
        if host is None or host.last_seen < now or (shapes and now - shapes[-1][0] < 0.25 - 1e-6):
            return shapes, before.rigid_since if shapes else None
        old = [r for t, r in shapes if now - t >= s.merged_lag_s - 1e-6]
        alike = bool(old) and shape_change(old[-1], host.region) < s.merged_change
        return (*shapes, (now, host.region))[-6:], _since(before.rigid_since, alike, now)

    def _at_rest(self, now: Measured, pair: Pair, mind: Mind) -> bool:
        if not set(pair) <= set(now.ids):
            return False
        i, j = (now.ids.index(x) for x in pair)
        return bool(at_rest(now, self.settings.relations, scale(mind.frame_size))[i, j])

    def _well_apart(self, now: Measured, pair: Pair, mind: Mind) -> bool:
        return now.pair("gap", *pair) > 0.02 * scale(mind.frame_size)

    def _joined(self, p: Pending, pair: Pair, mind: Mind) -> bool:
        s = self.settings
        if _host(pair, mind) is not None and _lasts(p.rigid_since, s.merged_s, mind.time):
            return True
        if not _lasts(p.rest_since, s.rest_s, mind.time):
            return False
        together = mind.relation("moving_together", *pair)
        if together is not None and together.truth is Truth.TRUE:
            return True
        return p.converged_at is not None and mind.time - p.converged_at <= s.approach_s

    def _relation(
        self,
        pair: Pair,
        coupling: Coupling | None,
        held: Held,
        mind: Mind,
    ) -> Relation:
        if coupling is not None:
            return Relation("coupled", pair, Truth.TRUE, coupling.since, 0.9)
        hidden = any(mind.objects[i].presence is not Presence.SEEN for i in pair)
        unknown = hidden or held.get(("touching", pair)) is Truth.UNKNOWN
        truth = Truth.UNKNOWN if unknown else Truth.FALSE
        return Relation("coupled", pair, truth, mind.time, 0.0 if unknown else 0.9)


def _host(pair: Pair, mind: Mind) -> ObjectBelief | None:
    """The object in whose region the two are merged now, or None."""
    for gone, host in merged_pairs(mind):
        if {gone, host} == set(pair):
            return mind.objects.get(host)
    return None


def _since(before: float | None, holds: bool, now: float) -> float | None:
    if not holds:
        return None
    return now if before is None else before


def _lasts(since: float | None, least: float, now: float) -> bool:
    return since is not None and now - since >= least - 1e-6


def _event(kind: str, template: str, pair: Pair, mind: Mind, observation: Observation) -> Event:
    text = sentence(mind, template, *pair)
    return Event(kind, observation.time, observation.frame_index, text, pair, 0.9)
