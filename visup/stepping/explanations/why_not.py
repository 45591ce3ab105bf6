"""Why something has not happened: which condition is not met, and by how much."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeVar

from visup.agent import Mind, ObjectBelief, Presence, Reasoner, Status, TaskBelief, Truth
from visup.agent.model.errors import SettingsError
from visup.rules.coupling.reasoner import COUPLING, CouplingReasoner, CouplingSettings
from visup.rules.identity.votes import VOTES, IdentityReasoner, ObjectVotes, VoteMemory
from visup.rules.presence.object_tracks import ObjectTrack, at_border, presence_memory
from visup.rules.presence.reasoner import PresenceReasoner
from visup.rules.presence.step_context import PresenceSettings
from visup.rules.safety.explain import RuleExplanation
from visup.rules.safety.queries import evaluation_of, explain, object_choices, rule_named
from visup.rules.safety.reasoner import rule_memory
from visup.rules.wording.sentences import short
from visup.stepping.explanations.evidence import Why, explanation_tree

Kind = TypeVar("Kind")


def rule_unmet(mind: Mind, name: str, ids: tuple[int, ...] = ()) -> Why:
    """Why a rule is not true.

    Args:
        mind: The mind.
        name: The rule.
        ids: Objects; the choice that comes nearest when left out.

    Returns:
        Its conditions that are false or unknown, each with its margin; what suspends it; or that it is
        true after all.

    Raises:
        RuleError: There is no such rule, or the objects are not those of a choice for it.
    """
    found = [explain(mind, name, *ids)] if ids else _each(mind, name)
    if not found:
        count = len(rule_named(evaluation_of(mind), name).variables)
        return Why(f"{name} is about {count} object(s), and so many are not in view")
    nearest = max(found, key=lambda e: (e.verdict is Truth.TRUE, *e.parts[0].interval))
    if nearest.verdict is Truth.TRUE:
        return Why(f"{nearest.text} is true", (explanation_tree(nearest),))
    when, *unless = nearest.parts
    parts = [
        Why(f"suspended: {u.line()}", (explanation_tree(u),))
        for u in unless
        if u.verdict is Truth.TRUE
    ]
    if when.verdict is not Truth.TRUE:
        parts.append(Why(when.line(), tuple(_unmet(when))))
    return Why(nearest.line(), tuple(parts), mind.frame_index, mind.time)


def _each(mind: Mind, name: str) -> list[RuleExplanation]:
    values = evaluation_of(mind)
    return [explain(mind, name, *ids) for ids in object_choices(values, rule_named(values, name))]


def _unmet(node: RuleExplanation) -> Iterator[Why]:
    """What keeps a formula from being true: its parts that are not; a comparison with its quantities."""
    for part in node.parts:
        if part.verdict is None:
            yield Why(part.line())
        elif part.verdict is not Truth.TRUE or " not " in f" {node.text}":
            yield Why(part.line(), tuple(_unmet(part)))


def stage_unmet(mind: Mind, stage: str) -> Why:
    """Why a stage is not under way.

    Raises:
        SettingsError: There is no such stage.
    """
    for task in mind.tasks:
        for number, s in enumerate(task.stages):
            if s.stage != stage:
                continue
            if s.status is not Status.PENDING:
                return Why(
                    f"stage {stage} has begun: it is {s.status.value}. {s.evidence}".rstrip()
                )
            return Why(f"stage {stage} is pending", tuple(_before_stage(mind, task, number)))
    known = ", ".join(s.stage for t in mind.tasks for s in t.stages) or "no task was given"
    raise SettingsError(f"there is no stage '{stage}'", expected=known)


def _before_stage(mind: Mind, task: TaskBelief, number: int) -> Iterator[Why]:
    for b in task.bindings:
        if b.object_id is None:
            yield Why(f"{b.actor} ({' or '.join(b.models)}) is played by nobody")
    for s in task.stages[:number]:
        if s.status is not Status.DONE:
            yield Why(f"before it, {s.stage} is {s.status.value}: {s.evidence or 'not begun'}")
    if task.verdict.value in ("interrupted", "failed", "succeeded"):
        yield Why(f"the task is {task.verdict.value}: {task.evidence}")
    for wanted in task.expected:
        r = mind.relation(wanted.relation, *wanted.objects)
        who = ", ".join(short(mind, i) for i in wanted.objects)
        if r is None or r.truth is not Truth.TRUE:
            stands = "not judged" if r is None else r.truth.value
            amount = "" if r is None or r.value is None else f"; its quantity is {r.value:.3g}"
            yield Why(f"awaited: {wanted.relation}({who}) is {stands}{amount}")


def entry_unmet(mind: Mind, object_id: int, reasoners: Sequence[Reasoner]) -> Why:
    """Why the entry of an object was not told."""
    belief, track = _tracked(mind, object_id)
    if belief.confirmed:
        return Why(f"object {object_id} has entered; first seen at {belief.first_seen:.2f} s")
    presence = _first(reasoners, PresenceReasoner)
    s = presence.settings if presence else PresenceSettings()
    parts = []
    if track is not None:
        start = presence_memory(mind).start or 0.0
        early = track.coherent_since - start <= s.start_s
        near = at_border(track.region, mind.frame_size)
        needed = s.entry_s if early or near else s.entry_inside_s
        steady = mind.time - track.coherent_since
        parts.append(_short_of("sightings", track.sightings, s.least_sightings, ""))
        parts.append(_short_of("seen steadily for", steady, needed, " s"))
    width, height = mind.frame_size
    if not belief.candidates:
        least = s.least_share * width * height
        parts.append(
            _short_of("area, while nobody says what it is", belief.region.area, least, " px")
        )
    parts.append(Why(f"last seen at {belief.last_seen:.2f} s"))
    return Why(f"object {object_id} has not entered", tuple(parts))


def presence_unmet(
    mind: Mind, object_id: int, wanted: Presence, reasoners: Sequence[Reasoner]
) -> Why:
    """Why an object is not believed hidden, gone, or seen."""
    belief, track = _tracked(mind, object_id)
    if belief.presence is wanted:
        return Why(f"object {object_id} is {wanted.value}")
    presence = _first(reasoners, PresenceReasoner)
    s = presence.settings if presence else PresenceSettings()
    parts = [Why(f"it is {belief.presence.value}, last seen at {belief.last_seen:.2f} s")]
    missing = mind.time - belief.last_seen
    if wanted is not Presence.SEEN:
        parts.append(_short_of("missing for", missing, s.settle_s, " s"))
    if track is not None:
        share = s.hidden_share if wanted is Presence.HIDDEN else s.leaving_share
        if wanted is not Presence.SEEN and missing == 0.0:
            parts.append(Why(f"{track.visible:.0%} of it shows, told below {share:.0%}"))
        elif wanted is Presence.SEEN:
            parts.append(_short_of("share of it that shows", track.visible, s.shown_share, ""))
    return Why(f"object {object_id} is not believed to be {wanted.value}", tuple(parts))


def identity_unmet(mind: Mind, object_id: int, reasoners: Sequence[Reasoner]) -> Why:
    """Why an object was not identified."""
    belief = _belief(mind, object_id)
    ballots: Any = mind.memory.get(VOTES, VoteMemory(mind.time))
    ballot: ObjectVotes = ballots.of.get(object_id, ObjectVotes())
    s = (_first(reasoners, IdentityReasoner) or IdentityReasoner()).settings
    if ballot.told is not None and ballot.told == belief.name:
        return Why(f"object {object_id} was identified as {ballot.told}")
    parts = []
    if not belief.candidates:
        most = max((votes for _, votes in ballot.tally), default=0.0)
        parts.append(_short_of("votes of the best name", most, s.known_votes, ""))
        parts.append(Why(f"votes for none of the models: {ballot.stranger:.3g}"))
    else:
        best = belief.candidates[0]
        parts.append(_short_of(f"likelihood of {best.name}", best.confidence, s.settle, ""))
        if ballot.leader is not None:
            parts.append(_short_of("leads for", mind.time - ballot.leads_since, s.settle_s, " s"))
    heard = "never" if ballot.heard is None else f"at {ballot.heard:.2f} s"
    parts.append(Why(f"what it looks like was last said {heard}"))
    if not belief.confirmed:
        parts.append(entry_unmet(mind, object_id, reasoners))
    return Why(f"object {object_id} is not identified", tuple(parts))


def coupling_unmet(mind: Mind, a: int, b: int, reasoners: Sequence[Reasoner]) -> Why:
    """Why two objects are not believed to be coupled."""
    low, high = sorted((a, b))
    for object_id in (low, high):
        _belief(mind, object_id)
    if mind.coupled(low, high):
        return Why(f"objects {low} and {high} are coupled")
    couple = _first(reasoners, CouplingReasoner)
    s = couple.settings if couple else CouplingSettings()
    pending: Any = mind.memory.get(COUPLING, {}).get((low, high))
    parts = []
    touching = mind.relation("touching", low, high)
    if touching is None or touching.truth is not Truth.TRUE:
        parts.append(Why(f"touching is {touching.truth.value if touching else 'not judged'}"))
    odds = getattr(pending, "rest_odds", 0.0)
    parts.append(_short_of("log odds that they touch and are at rest", odds, s.odds, ""))
    met = getattr(pending, "converged_at", None)
    together = mind.relation("moving_together", low, high)
    if together is None or together.truth is not Truth.TRUE:
        ago = "never" if met is None else f"{mind.time - met:.2f} s ago"
        parts.append(Why(f"they last converged {ago}, at most {s.approach_s:g} s ago is wanted"))
    return Why(f"objects {low} and {high} are not believed to be coupled", tuple(parts))


def relation_unmet(mind: Mind, name: str, objects: tuple[int, ...]) -> Why:
    """Why a relation is not true."""
    r = mind.relation(name, *objects)
    called = f"{name}({', '.join(map(str, objects))})"
    if r is None:
        away = [i for i in objects if i not in {b.id for b in mind.present()}]
        parts = tuple(Why(f"object {i} is not believed to be there") for i in away)
        return Why(f"{called} is not judged", parts)
    found = []
    if r.value is not None:
        about = "" if r.sigma is None else f" ± {r.sigma:.3g}"
        found.append(Why(f"its quantity is {r.value:.3g}{about}"))
    for i in objects:
        belief = mind.objects[i]
        if belief.last_seen < mind.time:
            found.append(Why(f"object {i} was last seen at {belief.last_seen:.2f} s"))
    return Why(f"{called} is {r.truth.value} since {r.since:.2f} s", tuple(found))


def alert_unmet(mind: Mind, kind: str, objects: tuple[int, ...]) -> Why:
    """Why no alert of a kind is open, where a rule gives it."""
    for alert in mind.alerts:
        if alert.kind == kind and (not objects or set(alert.objects) == set(objects)):
            return Why(f"alert {alert.id} is open since {alert.opened:.2f} s: {alert.cause}")
    why = rule_unmet(mind, kind, objects)
    cooling = rule_memory(mind).cooling.items()
    resting = [
        Why(f"it rests for objects {sorted(who)} until {until:.2f} s")
        for (rule, who), until in cooling
        if rule == kind
    ]
    return Why(why.text, (*why.parts, *resting), why.frame_index, why.time)


def _short_of(what: str, is_: float, wanted: float, unit: str) -> Why:
    """An amount beside what it must reach."""
    met = is_ >= wanted - 1e-9
    missing = "enough" if met else f"{wanted - is_:.3g}{unit} short"
    return Why(f"{what} {is_:.3g}{unit} of {wanted:.3g}{unit}: {missing}")


def _belief(mind: Mind, object_id: int) -> ObjectBelief:
    if object_id not in mind.objects:
        known = ", ".join(map(str, sorted(mind.objects))) or "none yet"
        raise SettingsError(f"there is no object {object_id}", expected=known)
    return mind.objects[object_id]


def _tracked(mind: Mind, object_id: int) -> tuple[ObjectBelief, ObjectTrack | None]:
    return _belief(mind, object_id), presence_memory(mind).of.get(object_id)


def _first(reasoners: Sequence[Reasoner], kind: type[Kind]) -> Kind | None:
    """The reasoner of a kind, also where it was made to hold to beliefs."""
    bare = (getattr(t, "reasoner", t) for t in reasoners)
    return next((t for t in bare if isinstance(t, kind)), None)
