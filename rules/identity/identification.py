"""Identification of objects: counts votes on names, and reports clear winners.

The vote itself is in `votes.py`. An operator's answer is not evidence but a fact, and overrides the vote.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

from visup.agent import (
    Candidate,
    Event,
    Hypothesis,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Presence,
)
from visup.agent.model.fast_replace import replace
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.rules.identity.votes import (
    VOTES,
    MatchKind,
    ObjectVotes,
    Tally,
    VoteMemory,
    VoteSettings,
    candidates,
    confirmed_candidate,
    similarity_weight,
    total_votes,
    unknown_probability,
    update_tally,
    weights,
)
from visup.rules.pose.reasoner import pose_support
from visup.rules.presence.association import hypotheses_by_object, recognised
from visup.rules.presence.object_tracks import at_border
from visup.rules.presence.reasoner import visible_share
from visup.rules.wording.conditions import (
    Condition,
    DecisionLog,
    ExplainableReasoner,
    at_least,
    decide,
)
from visup.rules.wording.sentences import (
    KIND_NAMES,
    REPORTED_NAMES,
    seems,
    with_article,
)


@dataclass(frozen=True, slots=True)
class NameEvidence:
    """The hypotheses about an object in one step.

    Attributes:
        kind: Source of the hypotheses: its silhouette ('shape'), or the behaviour that detected it ('found').
        hypotheses: Hypotheses in any order; empty if it was not matched.
    """

    kind: Literal["shape", "found"]
    hypotheses: tuple[Hypothesis, ...] = ()


def awaited(mind: Mind, object_id: int) -> frozenset[str]:
    """Models of tasks' actors that no other object is believed to be, unless that has left."""
    wanted = {model for models in mind.actors.values() for model in models}
    found = {
        b.name
        for b in mind.objects.values()
        if b.id != object_id and b.confirmed and b.presence is not Presence.LEFT
    }
    return frozenset(wanted - found)


def answered_model(mind: Mind, answer: str) -> str:
    """The model an answer refers to; the first model of an actor if it names an actor."""
    bindings = (b for task in mind.tasks for b in task.bindings if b.actor == answer)
    return next((b.models[0] for b in bindings if b.models), answer)


@dataclass(frozen=True, slots=True)
class IdentityReasoner(ExplainableReasoner):
    """Reasoner of the cogitate phase: counts votes and reports identities.

    It explains the decision 'identified' for every object.
    """

    settings: VoteSettings = field(default_factory=VoteSettings)

    def _reason(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        old = mind.recall(VOTES) or VoteMemory(observation.time)
        dt = max(0.0, observation.time - old.time)
        hypotheses = hypotheses_by_object(mind, observation)
        found = recognised(mind, observation)
        mind = _with_kinds(mind, hypotheses)
        votes_of: dict[int, ObjectVotes] = {}
        events: list[Event] = []
        beliefs: list[ObjectBelief] = []
        for object_id, belief in sorted(mind.objects.items()):
            before = old.votes.get(object_id, ObjectVotes())
            evidence = _name_evidence(belief, hypotheses.get(object_id, ()), found)
            votes = self._count(mind, belief, before, evidence, dt)
            updated = self._with_candidates(mind, belief, votes)
            beliefs.append(updated)
            votes = self._update_leader(votes, updated.candidates, observation.time)
            if decide(self._conditions(updated, votes, mind), log, "identified", (object_id,)):
                now = mind.with_objects(updated)
                events.append(_identified(now, updated, votes.reported, observation))
                votes = replace(votes, reported=votes.leader)
            votes_of[object_id] = votes
        mind = mind.with_objects(*beliefs)
        mind = mind.remember(VOTES, VoteMemory(observation.time, MappingProxyType(votes_of)))
        reported = {
            i: votes.reported for i, votes in votes_of.items() if votes.reported is not None
        }
        mind = mind.remember(REPORTED_NAMES, MappingProxyType(reported))
        return Outcome(mind, tuple(events))

    def _conditions(
        self, belief: ObjectBelief, votes: ObjectVotes, mind: Mind
    ) -> Iterator[Condition]:
        """Conditions for identifying an object as the leader of its votes."""
        s = self.settings
        if not belief.candidates:
            answered = mind.answers.get(belief.id) == UNKNOWN_OBJECT
            yield Condition("the operator did not say that it is none of the models", not answered)
            yield Condition("it may be one of the models", False)
            most = votes.counts[0][1] if votes.counts else 0.0
            yield at_least("votes of the best name", most, s.known_votes)
            yield at_least("votes of the best name, beside none of the models,", most, votes.none)
        name = belief.name
        yield Condition("it was not identified so before", votes.reported != name)
        yield at_least(f"likelihood of {name}", belief.confidence, s.report_likelihood)
        yield at_least("leads for", mind.time - votes.leads_since, s.report_s, " s", slack=1e-9)
        yield Condition("it has entered", belief.confirmed)

    def _count(
        self,
        mind: Mind,
        belief: ObjectBelief,
        votes: ObjectVotes,
        evidence: NameEvidence,
        dt: float,
    ) -> ObjectVotes:
        """The votes on an object after a step of `dt` seconds: decayed, plus those of its hypotheses."""
        s = self.settings
        visible = visible_share(mind, belief.id)
        hidden = belief.presence is not Presence.SEEN or visible < s.least_visible
        blind = not {"hypothesis", "region"}.isdisjoint(mind.unknown)
        tau = s.tau_hidden_s if hidden or blind else s.tau_s
        awaited_models = awaited(mind, belief.id)
        new_votes, share = Tally(), 0.0
        if evidence.hypotheses and not (hidden or blind):
            new = (
                1.0
                if votes.last_matched is None
                else min(1.0, (mind.time - votes.last_matched) / s.independent_s)
            )
            new_votes, share = (
                self._cast_votes(mind, belief.id, evidence, awaited_models),
                new * visible,
            )
            votes = replace(votes, last_matched=mind.time)
        tallies = {}
        for kind, tally in (("shape", votes.shape), ("found", votes.found)):
            kind_votes = new_votes if kind == evidence.kind else Tally()
            tallies[kind] = update_tally(tally, kind_votes, share, (dt, tau), s.most_candidates)
        return total_votes(replace(votes, **tallies), s, awaited_models)

    def _cast_votes(
        self, mind: Mind, object_id: int, evidence: NameEvidence, awaited_models: Collection[str]
    ) -> Tally:
        """The votes cast by the hypotheses of one step: weights of names, and of none of the models."""
        s = self.settings
        kind: MatchKind = getattr(s, evidence.kind)
        name_weights = weights(evidence.hypotheses, s, awaited_models, kind.awaited)
        if not at_border(mind.objects[object_id].region, mind.frame_size):
            # Views that are inconsistent over time count against a name (paper, figure 5). The visible
            # part of what the border cuts keeps changing, so that its views cannot agree.
            name_weights = {
                n: w * pose_support(mind, object_id, n) for n, w in name_weights.items()
            }
        return Tally(tuple(name_weights.items()), similarity_weight(s.unknown_similarity, s))

    def _with_candidates(
        self, mind: Mind, belief: ObjectBelief, votes: ObjectVotes
    ) -> ObjectBelief:
        """The belief about an object with its candidates: by the operator's answer, otherwise by votes."""
        s = self.settings
        answer = mind.answers.get(belief.id)
        if answer == UNKNOWN_OBJECT:
            return replace(belief, candidates=(), unknown=1.0)
        if answer is not None:
            name = answered_model(mind, answer)
            confirmed = (confirmed_candidate(name, votes.counts),)
            return replace(belief, candidates=confirmed, unknown=0.0)
        return replace(
            belief,
            candidates=candidates(votes.counts, s, votes.none),
            unknown=unknown_probability(votes.counts, s, votes.none),
        )

    def _update_leader(
        self, votes: ObjectVotes, named: tuple[Candidate, ...], now: float
    ) -> ObjectVotes:
        """The votes with the clear leader and its time updated."""
        clear = named and named[0].confidence >= self.settings.report_likelihood
        leader = named[0].name if clear else None
        since = votes.leads_since if leader == votes.leader else now
        return replace(votes, leader=leader, leads_since=since)


def _name_evidence(
    belief: ObjectBelief, hypotheses: tuple[Hypothesis, ...], found: Collection[int]
) -> NameEvidence:
    """The hypotheses about an object, with their kind."""
    return NameEvidence("found" if belief.id in found else "shape", hypotheses)


def _with_kinds(mind: Mind, hypotheses: Mapping[int, Sequence[Hypothesis]]) -> Mind:
    """The mind with the names of kinds recorded."""
    names = {h.name for some in hypotheses.values() for h in some if h.of_kind}
    known = mind.recall(KIND_NAMES)
    return (
        mind if names <= set(known) else mind.remember(KIND_NAMES, (*sorted(names | set(known)),))
    )


def _identified(
    mind: Mind, belief: ObjectBelief, before: str | None, observation: Observation
) -> Event:
    # Named by its model alone: its role in a task may be another object's, and lags behind.
    words, how = with_article(mind, belief.name), seems(belief.confidence)
    if before is None:
        text = f"Object {belief.id} {how} {words}."
    else:
        was = with_article(mind, before)
        text = f"Object {belief.id}, taken for {was}, {how} {words}."
    data = MappingProxyType({"name": belief.name, "before": before})
    return Event(
        "identified",
        observation.time,
        observation.frame_index,
        text,
        (belief.id,),
        belief.confidence,
        data=data,
    )
