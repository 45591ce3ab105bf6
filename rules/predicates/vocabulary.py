"""The vocabulary of the rule language: arguments, evaluation and meaning of each predicate and quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from operator import attrgetter
from types import MappingProxyType
from typing import Any

import numpy as np

from visup.agent import HealthStatus, ObjectBelief, Presence
from visup.rules.formula.truth import CODE_OF, MAYBE, NO, YES
from visup.rules.formula.units import (
    ANGLE,
    ANGULAR_SPEED,
    LENGTH,
    REAL_LENGTH,
    SHARE,
    SPEED,
    TIME,
)
from visup.rules.predicates import certainty
from visup.rules.predicates import image_quantities as image
from visup.rules.predicates import outline_quantities as outline
from visup.rules.predicates import signals as signal_words
from visup.rules.predicates._snapshot_jit import CLOSING, CONTACT, GAP, RELATIVE
from visup.rules.predicates.coarse_relations import COARSE_RELATIONS
from visup.rules.predicates.definitions import PredicateDefinition, QuantityDefinition, Vocabulary
from visup.rules.predicates.motion import moving, moving_clearly
from visup.rules.predicates.qualitative_words import allen_evaluator, tpcc_codes
from visup.rules.predicates.roles import is_actor, is_bystander
from visup.rules.predicates.snapshot import (
    RELATION_NAMES,
    SIGMAS,
    Codes,
    Floats,
    Snapshot,
    code,
    exact,
    interval_between,
)
from visup.rules.presence.object_tracks import presence_memory
from visup.rules.relations.zones import QUESTIONS, zone_truth
from visup.rules.wording.sentences import believed_name

IMPLIED_BY = MappingProxyType(
    {
        "converging": frozenset({"converging", "touching", "coupled"}),
        "touching": frozenset({"touching", "coupled"}),
        "keeping_distance": frozenset({"keeping_distance", "moving_together", "coupled"}),
        "moving_together": frozenset({"moving_together", "coupled"}),
    }
)
"""Relation -> expectations that imply it: objects to be coupled must converge and touch."""

PERCEPT_KINDS = ("region", "hypothesis", "depth", "health")

SURE_POSE = 0.6  # least confidence of a pose for its spin to count


def expected(facts: Snapshot, name: str) -> Codes:
    """Whether an active task expects a relation between two objects now."""
    codes, sufficient, row = facts.pairs(NO), IMPLIED_BY.get(name) or {name}, facts.row
    for task in facts.mind.tasks:
        for e in task.expected:
            if e.relation in sufficient and len(e.objects) == 2:
                i, j = (row.get(o, -1) for o in e.objects)
                if i >= 0 and j >= 0 and i != j:
                    codes[i, j] = codes[j, i] = YES
    return codes


def engaged(facts: Snapshot) -> Codes:
    """Whether an active task currently expects a relation of an object to another."""
    expected_objects = {o for task in facts.mind.tasks for e in task.expected for o in e.objects}
    return facts.codes_of_ids(expected_objects)


def unexpected(facts: Snapshot) -> Codes:
    """Whether no active task explains an object; without a task no object is unexpected."""
    unexplained = [task.unexplained for task in facts.mind.tasks]
    unexplained_by_all = set(unexplained[0]).intersection(*unexplained[1:]) if unexplained else ()
    return facts.codes_of_ids(unexplained_by_all)


def one_machine(facts: Snapshot) -> Codes:
    """Whether two objects are parts of one machine, as declared by a task."""
    codes, row = facts.pairs(NO), facts.row
    for parts in (m for task in facts.mind.tasks for m in task.machines):
        rows = [row[i] for i in parts if i in row]
        codes[np.ix_(rows, rows)] = YES
    return codes


def is_named(facts: Snapshot, name: str) -> Codes:
    """Whether an object is believed to be that model or actor; unknown while not identified."""

    def evaluate(b: ObjectBelief) -> int:
        return code(name in (b.name, believed_name(facts.mind, b.id))) if b.candidates else MAYBE

    return facts.codes_of_objects(evaluate)


def first_contact(facts: Snapshot) -> Codes:
    """Whether the second is the first contact of the first."""
    return facts.first_contact


def lost(facts: Snapshot) -> Codes:
    """Whether an object is out of view for no known reason."""
    known = presence_memory(facts.mind).tracks
    return facts.codes_of_ids([i for i in facts.ids if i in known and known[i].lost])


def stale(facts: Snapshot, kind: str) -> Codes:
    """Whether percepts of a kind could not be observed in this step."""
    return np.array(code(kind in facts.mind.unknown), dtype=np.int8)


def healthy(facts: Snapshot) -> Codes:
    """Whether the image is sound."""
    return np.array(code(facts.mind.health.status is HealthStatus.OK), dtype=np.int8)


def spin(facts: Snapshot) -> Floats:
    """Rotation rate of an object, degrees per second.

    Its deviation is that of one sequence of views; while another is nearly as likely it is unknown.
    """
    poses = (b.pose for b in facts.beliefs)
    found = [None if p is None or p.confidence < SURE_POSE else p.spin for p in poses]
    if not any(found):
        return facts.unknown(1)
    rate = np.array([np.nan if s is None else s.rate for s in found], dtype=float)
    sigma = np.array([0.0 if s is None else SIGMAS * s.sigma for s in found], dtype=float)
    return interval_between(np.maximum(rate - sigma, 0.0), rate + sigma)


def _since(moment: str) -> Callable[[Snapshot], Floats]:
    read = attrgetter(moment)
    return lambda facts: np.array(([facts.mind.time - read(b) for b in facts.beliefs],) * 2)


def _presence(expected_objects: Presence) -> Callable[[Snapshot], Codes]:
    return lambda facts: facts.codes_of_ids(
        [b.id for b in facts.beliefs if b.presence is expected_objects]
    )


def in_forbidden_zone(facts: Snapshot) -> Codes:
    """Whether some part of an object is in a zone that is forbidden to all."""
    zones = [z.name for z in facts.mind.zones if z.name.startswith(certainty.KEEP_OUT)]
    if not zones:
        return facts.codes_of_ids(())
    codes: Codes = np.max([_zone("reaching")(facts, name) for name in zones], axis=0)
    return codes


def _zone(question: str) -> Callable[[Snapshot, str], Codes]:
    return lambda facts, zone: facts.codes_of_objects(
        lambda b: CODE_OF[zone_truth(facts.mind, question, b.id, zone)]
    )


def _relation(name: str) -> PredicateDefinition:
    meaning = f"{name.replace('_', ' ')}, a relation"
    return PredicateDefinition(_TWO, lambda facts: facts.relation_codes(name), meaning)


_ONE, _TWO = ("object",), ("object", "object")

PREDICATES: MappingProxyType[str, PredicateDefinition] = MappingProxyType(
    {
        **{name: _relation(name) for name in RELATION_NAMES},
        **{
            name: PredicateDefinition(_TWO, evaluate, meaning)
            for name, (evaluate, meaning) in {
                **COARSE_RELATIONS,
                **outline.OUTLINE_RELATIONS,
            }.items()
        },
        "expected": PredicateDefinition(
            ("relation", "object", "object"), expected, "an active task expects the relation"
        ),
        "engaged": PredicateDefinition(
            _ONE, engaged, "an active task expects something of the object now"
        ),
        "unexpected": PredicateDefinition(_ONE, unexpected, "no active task explains the object"),
        "actor": PredicateDefinition(_ONE, is_actor, "the object plays an actor of an active task"),
        "bystander": PredicateDefinition(_ONE, is_bystander, "a task ignores the object"),
        "one_machine": PredicateDefinition(_TWO, one_machine, "they are parts of one machine"),
        "named": PredicateDefinition(
            ("object", "name"), is_named, "the object is believed to be that"
        ),
        "standalone": PredicateDefinition(
            _ONE,
            certainty.standalone,
            "it is certainly an object of its own, not part of a larger one",
        ),
        "identified": PredicateDefinition(
            _ONE, certainty.identified, "it is more likely a known model than none of them"
        ),
        "of_kind": PredicateDefinition(
            _ONE, certainty.of_kind, "only its kind is known, as reported by a detector"
        ),
        "seen": PredicateDefinition(_ONE, _presence(Presence.SEEN), "the object is seen"),
        "hidden": PredicateDefinition(_ONE, _presence(Presence.HIDDEN), "it is out of sight"),
        "lost": PredicateDefinition(_ONE, lost, "it is out of sight for no known reason"),
        "moving": PredicateDefinition(_ONE, moving, "it moves in the image"),
        "moving_clearly": PredicateDefinition(
            _ONE, moving_clearly, "it moves, and its velocity is well known"
        ),
        "came_in": PredicateDefinition(
            _ONE, certainty.came_in, "it came over the border of the image"
        ),
        "near_moving_actor": PredicateDefinition(
            _ONE, certainty.near_moving_actor, "it is near an actor that moves, or near what is"
        ),
        "whole": PredicateDefinition(_ONE, certainty.whole, "it is clear of the image border"),
        **{
            question: PredicateDefinition(
                ("object", "zone"), _zone(question), f"{part} is in the zone"
            )
            for question, part in zip(
                QUESTIONS, ("its centre", "some part", "all of it"), strict=True
            )
        },
        "in_forbidden_zone": PredicateDefinition(
            _ONE,
            in_forbidden_zone,
            f"some part is in a zone whose name begins with {certainty.KEEP_OUT}",
        ),
        "at_home": PredicateDefinition(
            _ONE, certainty.at_home, "it was in such a zone when the video began"
        ),
        "first_contact": PredicateDefinition(
            _TWO, first_contact, "the second is what the first would meet first"
        ),
        "stale": PredicateDefinition(
            ("kind",), stale, "percepts of that kind could not be observed"
        ),
        "healthy": PredicateDefinition((), healthy, "the image is usable"),
        **{
            name: PredicateDefinition(
                ("allen", *_TWO), allen_evaluator(axis), f"Allen's relation of boxes, {direction}"
            )
            for name, axis, direction in (
                ("along_x", 0, "to the right"),
                ("along_y", 1, "downwards"),
            )
        },
        "tpcc": PredicateDefinition(
            ("tpcc", *_TWO, "object"), tpcc_codes, "where the third is, for one from a to b"
        ),
        "signal_on": PredicateDefinition(
            ("signal",), signal_words.is_on, "the signal is true, or a number other than 0"
        ),
        "signal_is": PredicateDefinition(
            ("signal", "word"), signal_words.is_word, "the signal is that word"
        ),
        "signal_known": PredicateDefinition(
            ("signal",), signal_words.is_known, "the signal is known"
        ),
    }
)
"""All relations and facts available in rules."""

QUANTITIES: MappingProxyType[str, QuantityDefinition] = MappingProxyType(
    {
        "time_to_contact": QuantityDefinition(
            _TWO, TIME, lambda f: f.pair_intervals(CONTACT), "until the outlines meet"
        ),
        "gap": QuantityDefinition(
            _TWO, LENGTH, lambda f: f.pair_intervals(GAP), "between the outlines"
        ),
        "closing_speed": QuantityDefinition(
            _TWO, SPEED, lambda f: f.pair_intervals(CLOSING), "of the distance"
        ),
        "relative_speed": QuantityDefinition(
            _TWO, SPEED, lambda f: f.pair_intervals(RELATIVE), "in the image"
        ),
        "speed": QuantityDefinition(_ONE, SPEED, lambda f: exact(f.one("speed")), "in the image"),
        "depth": QuantityDefinition(
            _ONE, REAL_LENGTH, image.depth, "how far away it is, by the size of its model"
        ),
        "depth_difference": QuantityDefinition(
            _TWO, SHARE, image.depth_difference, "of the smaller depth"
        ),
        "spin": QuantityDefinition(_ONE, ANGULAR_SPEED, spin, "about itself"),
        "out_of_sight": QuantityDefinition(_ONE, TIME, _since("last_seen"), "since last seen"),
        "in_view": QuantityDefinition(_ONE, TIME, _since("first_seen"), "since first seen"),
        "position_x": QuantityDefinition(
            _ONE, LENGTH, image.horizontal_position, "of the centre, from the left"
        ),
        "position_y": QuantityDefinition(
            _ONE, LENGTH, image.vertical_position, "of the centre, from the top"
        ),
        "width": QuantityDefinition(_ONE, LENGTH, image.width, "of the box"),
        "height": QuantityDefinition(_ONE, LENGTH, image.height, "of the box"),
        "area": QuantityDefinition(_ONE, SHARE, image.area_share, "share of the image"),
        "heading": QuantityDefinition(_ONE, ANGLE, image.heading, "0 to the right, 90 up"),
        "orientation": QuantityDefinition(_ONE, ANGLE, outline.orientation, "of the long axis"),
        "axis_angle": QuantityDefinition(_TWO, ANGLE, outline.axis_angle, "between the long axes"),
        "openness": QuantityDefinition(_ONE, SHARE, outline.openness, "of the hull, left free"),
        "shared_outline": QuantityDefinition(
            _TWO, SHARE, outline.shared_outline, "of one, along the other: the greater share"
        ),
        "confidence": QuantityDefinition(_ONE, SHARE, image.confidence, "of the identity"),
        "centre_distance": QuantityDefinition(
            _TWO, LENGTH, image.centre_distance, "between the centres"
        ),
        "overlap": QuantityDefinition(
            _TWO, SHARE, image.box_overlap, "of the boxes: intersection over union"
        ),
        "objects": QuantityDefinition(
            (), SHARE, image.number_of_objects, "how many are in sight", plain=True
        ),
        "signal": QuantityDefinition(
            ("signal",), SHARE, signal_words.number, "a signal that is a number", plain=True
        ),
        "objects_named": QuantityDefinition(
            ("name",), SHARE, image.number_of_kind, "how many of a name are", plain=True
        ),
    }
)
"""All quantities available in rules."""

RULES = Vocabulary(PREDICATES, QUANTITIES)
"""The vocabulary of rules."""


def signals(*names: str) -> Vocabulary:
    """A vocabulary of plain numbers without objects, each written `name()`."""
    nothing: Mapping[str, Any] = MappingProxyType({})
    one = QuantityDefinition((), SHARE, lambda facts: np.zeros(2), "a signal", plain=True)
    return Vocabulary(nothing, MappingProxyType(dict.fromkeys(names, one)))
