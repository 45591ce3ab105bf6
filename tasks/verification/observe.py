"""The observation of one action at one moment: the relations for and against it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from types import MappingProxyType

from visup.agent import Mind, Presence, Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.rules.formula.truth import truth_if
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.relations.reasoner import kinematics
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.rhythm import Beats, Rhythm, heard
from visup.tasks.actions.vocabulary import FactEvaluator
from visup.tasks.verification.new_trends import NewTrends
from visup.tasks.verification.observation import (
    NO_MEMORY,
    UNOBSERVED,
    ActionObservation,
    ObservationMemory,
)
from visup.tasks.verification.passing import (
    came_apart,
    gapes,
    goes_past,
    goes_round,
    holds_on,
    moves_on,
    passed_since,
    put_down,
    slow,
    still_meet,
    stopped_at,
    went_past,
    went_round,
)
from visup.tasks.verification.pauses import PauseRecord

NOTHING: Mapping[str, FactEvaluator] = MappingProxyType({})
NO_RHYTHMS: Mapping[str, Rhythm] = MappingProxyType({})
TRENDS = ("converging", "diverging")
CONTACTS = ("touching", "in_contact", "on")

CARRIED_SPEED = 0.005
"""Least speed at which coupled objects count as moving together, image diagonals per second."""

REST_S = 0.3
"""How long the relative speed must be low for a body that passed another one to rest there, seconds."""


class RelationLookup:
    """All relations of a mind at one moment, by name and objects.

    Args:
        mind: The mind; also an attribute.
        looks: Evaluators of facts that are not relations of the mind (see `task_vocabulary`).
        before: The state of the previous moment.
        rhythms: Periodic facts, by key.
    """

    def __init__(
        self,
        mind: Mind,
        evaluators: Mapping[str, FactEvaluator] = NOTHING,
        before: ObservationMemory = NO_MEMORY,
        rhythms: Mapping[str, Rhythm] = NO_RHYTHMS,
    ) -> None:
        self.mind = mind
        self._evaluators = evaluators
        self._rhythms = rhythms
        self._previous_time = mind.time if before.time is None else before.time
        self._before = dict(before.lasting)
        self._beats_before = dict(before.beats)
        self._beats: dict[str, tuple[Beats, Truth]] = {}
        self._evaluated: dict[tuple[str, tuple[int, ...]], Relation] = {}
        self._found: dict[tuple[str, tuple[int, ...]], Relation] = {}
        self._passed_by: dict[tuple[int, ...], bool] = {}
        self._new_trends = NewTrends(mind)
        self._queried: set[str] = set()
        self._after: dict[str, float] = {}

    def find(self, name: str, objects: tuple[int, ...]) -> Relation:
        """The relation of that name between these objects; one of unknown truth when there is none.

        `decoupled`, `apart`, `on`, `present` and `gone` are derived from other beliefs unless a rule
        states them.
        """
        if name in self._evaluators:
            return self._evaluate(name, objects)
        if name in self._rhythms:
            return self._rhythm_relation(self._rhythms[name], name, objects)
        found = self._found.get((name, objects))
        if found is None:
            found = self._found[name, objects] = self._given_or_derived(name, objects)
        return found

    def _given_or_derived(self, name: str, objects: tuple[int, ...]) -> Relation:
        found = self.mind.relation(name, *objects)
        if name == "touching" and found is not None and self.passes_by(objects):
            return replace(found, truth=Truth.UNKNOWN)
        if name == "touching" and found is not None and found.truth is Truth.TRUE:
            found = replace(found, since=max(found.since, stopped_at(self.mind, objects)))
        settled = found is not None and found.truth is not Truth.UNKNOWN
        if (
            found is not None
            and settled
            and (name != "moving_together" or found.truth is Truth.TRUE)
        ):
            return found
        derive = DERIVED.get(name)
        derived = derive(self.mind, self, objects) if derive else None
        return derived or found or Relation(name, objects, Truth.UNKNOWN, self.mind.time)

    def _rests(self, objects: tuple[int, ...]) -> bool:
        """Whether one body has come to rest relative to the other, even if it is out of sight since."""
        rest = self.lasting("rests", objects, slow(self.mind, objects))
        return rest.truth is Truth.TRUE and self.time - rest.since >= REST_S - 1e-9

    def passes_by(self, objects: tuple[int, ...]) -> bool:
        """Whether outlines meet only because one of two passes the other, or is carried past it."""
        if objects not in self._passed_by:
            meets = self.mind.truth("touching", *objects) is Truth.TRUE
            self._passed_by[objects] = meets and goes_past(self.mind, objects, self._rests)
        return self._passed_by[objects]

    def carried_past(self, objects: tuple[int, ...]) -> bool:
        """Whether outlines meet only because one of two is carried past the other."""
        return bool(holds_on(self.mind, objects)) and self.passes_by(objects)

    def unreached(
        self, action: str, objects: tuple[int, ...], contrary: Relation | None
    ) -> float | None:
        """Time since when an approach or carrying is over without having reached its goal, or None.

        One body has passed the other, or the carried one has been put down.
        """
        ways = {"moving_together": (objects, objects[::-1]), "converging": (objects,)}
        if any(put_down(self.mind, way) for way in ways.get(action, ())):
            return self.time
        if contrary is None or (action, contrary.name) != ("converging", "diverging"):
            return None
        return contrary.since if went_past(self.mind, contrary) else None

    def begun(
        self, names: tuple[str, ...], objects: tuple[int, ...]
    ) -> tuple[Relation | None, Relation | None]:
        """The first true one of some relations, and a sudden trend among them; each may be None."""
        entry = self.first_true(names, objects)
        if entry is not None and entry.name == "coupled" and gapes(self.mind, *objects):
            return None, None  # there is a gap: the coupling will soon be doubted
        if entry is not None:
            return (None if self._new_trends.has_opposite(entry) else entry), None
        sudden = self._new_trends.first_new(names, objects)
        return sudden, sudden

    def goes_round(self, trend: str, objects: tuple[int, ...]) -> bool:
        """Whether a trend is due to one body moving around the other; False if unknown."""
        return goes_round(self.mind, trend, objects)

    def explains_away(self, trend: Relation, action: str, objects: tuple[int, ...]) -> bool:
        """Whether a trend contradicts an action only in appearance.

        A body that passes over or around another one recedes from it a little. After two bodies have met,
        closing fingers or a rotating body change the gap of the outlines while the bodies stay in contact.
        Coupled bodies move together, however their outlines drift.
        """
        if trend.name not in TRENDS:
            return False
        if action == "moving_together" and self.find("coupled", objects).truth is Truth.TRUE:
            return True
        if action == "coupled" and still_meet(self.mind, objects):
            return True
        met = action == "converging" and self.find("in_contact", objects).truth is Truth.TRUE
        return met or self.goes_round(trend.name, objects) or went_round(self.mind, trend)

    @property
    def time(self) -> float:
        """Time of this moment, seconds."""
        return self.mind.time

    @cached_property
    def _facts(self) -> Snapshot:
        return Snapshot(self.mind)

    def _evaluate(self, name: str, objects: tuple[int, ...]) -> Relation:
        key = (name, objects)
        if key not in self._evaluated:
            truth = self._evaluators[name](self._facts, objects)
            self._evaluated[key] = self.lasting(name, objects, truth)
        return self._evaluated[key]

    def lasting(self, name: str, objects: tuple[int, ...], truth: Truth) -> Relation:
        """A relation of that truth, with the time since when it has been true without a break.

        While it is not observed that time is retained: unknown is not false.
        """
        key = f"{name} {objects}"
        self._queried.add(key)
        since = self._before.get(key, self.mind.time)
        if truth is Truth.TRUE or (truth is Truth.UNKNOWN and key in self._before):
            self._after[key] = since
        return Relation(name, objects, truth, since if truth is Truth.TRUE else self.mind.time)

    def memory(self, pauses: PauseRecord, carry: bool) -> ObservationMemory:
        """The state of this moment, for the next.

        Args:
            pauses: All pauses so far.
            carry: Whether facts that were not queried retain their previous state.
        """
        lasting, beats = self._after, {key: b for key, (b, _) in self._beats.items()}
        if carry:
            unasked = {k: s for k, s in self._before.items() if k not in self._queried}
            lasting, beats = unasked | lasting, self._beats_before | beats
        return ObservationMemory(self.time, tuple(lasting.items()), tuple(beats.items()), pauses)

    def _rhythm_relation(self, rhythm: Rhythm, name: str, objects: tuple[int, ...]) -> Relation:
        """The relation that a periodic fact keeps its rhythm, or is late, depending on `rhythm`."""
        key = f"{rhythm.key} {objects}"
        if key not in self._beats:
            held_by = self.first_true(rhythm.holds, objects)
            known = held_by is not None or self.known(rhythm.holds, objects)
            truth = truth_if(held_by is not None) if known else Truth.UNKNOWN
            since = self.time if held_by is None else held_by.since
            moment = self._previous_time, self.time
            before = self._beats_before.get(key)
            self._beats[key] = heard(before, truth, since, moment, rhythm.period), truth
        beats, truth = self._beats[key]
        result = truth_if(beats.late if rhythm.late else beats.keeps)
        result = result if truth is not Truth.UNKNOWN else truth
        return Relation(name, objects, result, beats.since)

    def first_true(self, names: Iterable[str], objects: tuple[int, ...]) -> Relation | None:
        """The first of some relations that is true, or None."""
        for name in names:
            relation = self.find(name, objects)
            if relation.truth is Truth.TRUE:
                return relation
        return None

    def first_given(self, names: Iterable[str], objects: tuple[int, ...]) -> Relation | None:
        """The first of some relations that a rule states as true, not merely derived ones.

        Objects that are not coupled yet are `decoupled` in the derived sense, which is no failure.
        """
        for name in names:
            relation = self.mind.relation(name, *objects)
            if name in self._evaluators or name in self._rhythms:
                relation = self.find(name, objects)
            if relation is not None and relation.truth is Truth.TRUE:
                return relation
        return None

    def known(self, names: Iterable[str], objects: tuple[int, ...]) -> bool:
        """Whether the truth of any of some relations is known."""
        return any(self.find(n, objects).truth is not Truth.UNKNOWN for n in names)


def observe(
    meaning: ActionDefinition, objects: tuple[int | None, ...], relations: RelationLookup
) -> ActionObservation:
    """The observation of an action.

    Args:
        meaning: The action.
        objects: Ids of the objects bound to its actors; None for one that is not found.
        relations: The current relations.

    Returns:
        The observation; `UNOBSERVED` when an actor is not found.
    """
    ids = tuple(o for o in objects if o is not None)
    if len(ids) < len(objects):
        return UNOBSERVED
    held_by = relations.first_true(meaning.holds, ids)
    holds = Truth.TRUE if held_by else _not_true(meaning, ids, relations)
    helps = relations.first_true(meaning.helps, ids)
    contrary = relations.first_given(meaning.contrary, ids)
    if contrary is None and meaning.name == "moving_together":
        contrary = came_apart(relations.mind, ids)
    unreached = relations.unreached(meaning.name, ids, contrary)
    within = meaning.measures and holds is not Truth.FALSE
    if contrary is not None and (within or relations.explains_away(contrary, meaning.name, ids)):
        contrary = None
    entry, new_trend = relations.begun(meaning.begins, ids)
    by_contact = not set(CONTACTS).isdisjoint(meaning.begins)
    return ActionObservation(
        holds=holds,
        held_by=held_by,
        helps=helps,
        entry=entry,
        contrary=contrary,
        observed=relations.known((*meaning.helps, *meaning.contrary), ids),
        new_trend=new_trend,
        round=entry is not None and entry.name in TRENDS and relations.goes_round(entry.name, ids),
        moves_on=held_by is not None and held_by.name in CONTACTS and moves_on(relations.mind, ids),
        unreached=unreached,
        carried=bool(holds_on(relations.mind, ids)),
        carried_past=by_contact and relations.carried_past(ids),
        passed_since=passed_since(relations.mind, ids) if by_contact else None,
    )


def _not_true(meaning: ActionDefinition, ids: tuple[int, ...], relations: RelationLookup) -> Truth:
    """False when any relation by which the action holds is known, as none of them is true; else unknown."""
    return Truth.FALSE if relations.known(meaning.holds, ids) else Truth.UNKNOWN


Derive = Callable[[Mind, RelationLookup, tuple[int, ...]], Relation | None]


def _coupled(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    """Coupled according to the mind's couplings, when it has no relation of that name."""
    if mind.relation("coupled", *ids) is not None:
        return None  # the relation is in doubt, which prevails
    pair = tuple(sorted(ids))
    since = next((c.since for c in mind.couplings if c.objects == pair), None)
    return None if since is None else Relation("coupled", ids, Truth.TRUE, since)


def _decoupled(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    return _opposite("decoupled", relations.find("coupled", ids))


def _moving_together(
    mind: Mind, relations: RelationLookup, ids: tuple[int, ...]
) -> Relation | None:
    """Moving together: they are coupled and the slower one moves, however much the other sways."""
    # The speed of a body that is hidden, or cut by the border, may be unknown: it moves as the other does.
    speeds = [kinematics(mind).one("speed", i) for i in ids]
    slower = min((speed for speed in speeds if not math.isnan(speed)), default=0.0)
    moves = slower > CARRIED_SPEED * image_diagonal(mind.frame_size)
    on_the_move = relations.lasting("on_the_move", ids, Truth.TRUE if moves else Truth.FALSE)
    coupled = relations.find("coupled", ids)
    if coupled.truth is not Truth.TRUE or not moves:
        return None
    since = max(on_the_move.since, coupled.since)
    return Relation("moving_together", ids, Truth.TRUE, since)


def _in_contact(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    """In contact means touching, unless a rule states it."""
    if mind.relation("in_contact", *ids) is not None:
        return None
    return replace(relations.find("touching", ids), name="in_contact")


def _apart(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    return _opposite("apart", relations.find("touching", ids))


def _on(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    """The first touches the second and its centre is above it in the image."""
    touching = relations.find("touching", ids)
    first, second = mind.objects.get(ids[0]), mind.objects.get(ids[1])
    if touching.truth is Truth.UNKNOWN or first is None or second is None:
        return None
    (x, y), (left, _, width, _) = first.region.centroid, second.region.bbox
    above = y < second.region.centroid[1] and left <= x <= left + width
    truth = Truth.TRUE if touching.truth is Truth.TRUE and above else Truth.FALSE
    return Relation("on", ids, truth, touching.since, touching.confidence)


def _present(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    belief = mind.objects.get(ids[0])
    if belief is None:
        return None
    here = belief.presence is not Presence.LEFT
    since = belief.first_seen if here else belief.last_seen
    return Relation("present", ids, Truth.TRUE if here else Truth.FALSE, since)


def _gone(mind: Mind, relations: RelationLookup, ids: tuple[int, ...]) -> Relation | None:
    return _opposite("gone", relations.find("present", ids))


def _opposite(name: str, relation: Relation) -> Relation | None:
    if relation.truth is Truth.UNKNOWN:
        return None
    truth = Truth.FALSE if relation.truth is Truth.TRUE else Truth.TRUE
    return Relation(name, relation.objects, truth, relation.since, relation.confidence)


DERIVED: Mapping[str, Derive] = {
    "coupled": _coupled,
    "in_contact": _in_contact,
    "moving_together": _moving_together,
    "decoupled": _decoupled,
    "apart": _apart,
    "on": _on,
    "present": _present,
    "gone": _gone,
}
"""Relations that follow from others or from presence."""
