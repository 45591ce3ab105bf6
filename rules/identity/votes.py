"""Who is who: the weighted, occlusion-sensitive, time-discounted vote (paper, section 5, figure 5).

For each object o and each model name n, in each step of length dt:

    v(o, n) <- v(o, n) * exp(-dt / tau) + w
    w = new * visible(o) * p(o, n) * rank^k * (s - 0.4) / (1 - 0.4)

where s is the best similarity with which any view of n was hypothesised for o's region in this
step (nothing at or below 0.4 counts; section 7.3), k the place of n among the names of this step
(0 for the best), p(o, n) how well its views hang together over time (`pose_support`), and visible(o)
the share of o that is in sight. What a task expects to see, and no other object is believed to be,
counts as a little more similar: it was more likely before anybody looked. Hypotheses that follow
each other fast are of the same picture:
`new` is the time since the last ones, as a share of `apart_s`, at most 1. The three principles:

1. recurrent and temporally stable hypotheses are more likely: votes add up over steps;
2. what has not been hypothesised lately is forgotten: votes decay with `tau_s`;
3. an occluded object keeps its votes for some time: while it is hidden, or while nobody could look,
   they decay with `tau_hidden_s` instead.

The set of names is open. Whatever is in view, the database has something that is a little like it:
each time, the possibility that the object is none of the models gets the vote of a name of
similarity `stranger`. While it has the most votes, because all names are weak or change all the
time, the object is an 'unknown object'.

Votes are read as evidence: the likelihood of a name is proportional to exp(`evidence` * v). What
the operator answers is no evidence but a fact, and settles the vote.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import exp
from types import MappingProxyType

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
from visup.agent.model.mind import UNKNOWN_OBJECT
from visup.rules.pose.reasoner import pose_support
from visup.rules.presence.association import hypotheses_by_object
from visup.rules.presence.reasoner import visible_share
from visup.rules.wording.sentences import called, seems, spaced

VOTES = "rules.votes"
VoteCounts = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class VoteSettings:
    """How votes are counted.

    Attributes:
        least_similarity: Hypotheses at or below it do not count (paper: 0.4).
        tau_s: Votes of a seen object fall to 37 % in this time.
        tau_hidden_s: The same for a hidden object.
        rank: Weight of each name relative to the name above it in the same step.
        least_visible: Below this share in sight an object is treated as hidden.
        most_candidates: Names kept for an object.
        least_share: Names with a smaller share of the votes are dropped.
        known_votes: Votes that the best name needs for the object to be known at all.
        stranger: Similarity that an object has to some model even when it is none of them.
        awaited: How much more similar a model counts that an actor of a task stands for, while no
            other object is believed to be it.
        apart_s: Hypotheses this far apart in time are of different pictures.
        evidence: How much a vote tells, in units of log likelihood.
        settle: Likelihood at which a name is told.
        settle_s: How long it must have had it.
    """

    least_similarity: float = 0.4
    tau_s: float = 6.0
    tau_hidden_s: float = 60.0
    rank: float = 0.8
    least_visible: float = 0.5
    most_candidates: int = 5
    least_share: float = 0.03
    known_votes: float = 0.3
    stranger: float = 0.5
    awaited: float = 0.06
    apart_s: float = 0.2
    evidence: float = 2.2
    settle: float = 0.7
    settle_s: float = 0.8


@dataclass(frozen=True)
class ObjectVotes:
    """What is remembered of one object's votes.

    Attributes:
        tally: (name, votes), most votes first.
        stranger: Votes for its being none of the models.
        heard: Seconds of the last hypotheses about it, or None.
        leader: The name that leads clearly now, or None.
        leads_since: Seconds since when it does.
        told: The name that was told last, or None.
    """

    tally: VoteCounts = ()
    stranger: float = 0.0
    heard: float | None = None
    leader: str | None = None
    leads_since: float = 0.0
    told: str | None = None


@dataclass(frozen=True, slots=True)
class VoteMemory:
    """All votes.

    Attributes:
        time: Seconds of the last count.
        of: Object id -> its votes.
    """

    time: float
    of: Mapping[int, ObjectVotes] = field(default_factory=lambda: MappingProxyType({}))


def weights(
    hypotheses: tuple[Hypothesis, ...],
    settings: VoteSettings,
    awaited: Collection[str] = (),
) -> dict[str, float]:
    """Weights of the names hypothesised for one region in one step.

    Args:
        hypotheses: All of them, in any order.
        settings: Threshold and rank discount.
        awaited: Models that are expected and not yet found.

    Returns:
        Name -> weight, 0 to 1, best first.
    """
    best: dict[str, float] = {}
    for h in hypotheses:
        if h.similarity > settings.least_similarity:
            similarity = min(1.0, h.similarity + settings.awaited * (h.name in awaited))
            best[h.name] = max(best.get(h.name, 0.0), similarity)
    ranked = sorted(best.items(), key=lambda item: (-item[1], item[0]))
    return {name: settings.rank**k * _worth(s, settings) for k, (name, s) in enumerate(ranked)}


def awaited(mind: Mind, object_id: int) -> frozenset[str]:
    """Models that actors of tasks stand for and that no other object in view is believed to be."""
    wanted = {model for models in mind.actors.values() for model in models}
    found = {
        b.name
        for b in mind.objects.values()
        if b.id != object_id and b.confirmed and b.presence is not Presence.LEFT
    }
    return frozenset(wanted - found)


def _worth(similarity: float, settings: VoteSettings) -> float:
    """What a similarity counts, 0 to 1."""
    room = 1.0 - settings.least_similarity
    return max(0.0, similarity - settings.least_similarity) / room


def updated_votes(
    tally: VoteCounts,
    new: Mapping[str, float],
    dt: float,
    tau: float,
    most: int,
    visible: float = 1.0,
) -> VoteCounts:
    """One step of the vote for one object.

    Args:
        tally: Votes before.
        new: Weights of this step's names.
        dt: Seconds since the last count.
        tau: Time constant, seconds.
        most: Names to keep.
        visible: Share of the object in sight, 0 to 1.

    Returns:
        Votes after, most first.
    """
    fade = exp(-dt / tau)
    votes = {name: v * fade for name, v in tally}
    for name, weight in new.items():
        votes[name] = votes.get(name, 0.0) + visible * weight
    ranked = sorted(votes.items(), key=lambda item: (-item[1], item[0]))
    return tuple((n, v) for n, v in ranked[: 2 * most] if v > 1e-4)


def candidates(
    tally: VoteCounts, settings: VoteSettings, stranger: float = 0.0
) -> tuple[Candidate, ...]:
    """Candidates that votes allow, each with its likelihood.

    Args:
        tally: Votes, most first.
        settings: How many candidates are kept, and how votes are read.
        stranger: Votes for the object's being none of the models.

    Returns:
        Most likely first; none while the best has too few votes, or fewer than a stranger has.
    """
    if not tally or tally[0][1] <= 0.0 or tally[0][1] < max(settings.known_votes, stranger):
        return ()
    total = sum(v for _, v in tally)
    odds = [exp(settings.evidence * (v - tally[0][1])) for _, v in tally]
    whole = sum(odds) + exp(settings.evidence * (stranger - tally[0][1]))
    found = (
        Candidate(name, v, v / total, o / whole)
        for (name, v), o in zip(tally[: settings.most_candidates], odds, strict=False)
    )
    return tuple(c for c in found if c.share >= settings.least_share)


def unknown_probability(tally: VoteCounts, settings: VoteSettings, stranger: float) -> float:
    """How likely an object is none of the models, 0 to 1; 1 while nothing was said of it."""
    odds = sum(exp(settings.evidence * (v - stranger)) for _, v in tally)
    return 1.0 / (1.0 + odds)


def confirmed_candidate(name: str, tally: VoteCounts) -> Candidate:
    """The only candidate, once the operator has said what an object is."""
    return Candidate(name, dict(tally).get(name, 0.0), 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class IdentityReasoner:
    """Reasoner of the cogitate phase: counts votes and tells who is who."""

    settings: VoteSettings = VoteSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Count one step; see `Reasoner`."""
        old: VoteMemory = mind.memory.get(VOTES, VoteMemory(observation.time))
        dt = max(0.0, observation.time - old.time)
        said = hypotheses_by_object(mind, observation)
        ballots: dict[int, ObjectVotes] = {}
        events: list[Event] = []
        beliefs: list[ObjectBelief] = []
        for object_id, belief in sorted(mind.objects.items()):
            before = old.of.get(object_id, ObjectVotes())
            ballot = self._count(mind, belief, before, said.get(object_id, ()), dt)
            believed = self._believe(mind, belief, ballot)
            beliefs.append(believed)
            after = self._lead(ballot, believed.candidates, observation.time)
            if after.told != before.told:
                event = _identified(mind.with_objects(believed), believed, before.told, observation)
                after = after if belief.confirmed else replace(after, told=before.told)
                events += [event] if belief.confirmed else []
            ballots[object_id] = after
        mind = mind.with_objects(*beliefs)
        mind = mind.remember(VOTES, VoteMemory(observation.time, MappingProxyType(ballots)))
        return Outcome(mind, tuple(events))

    def _count(
        self,
        mind: Mind,
        belief: ObjectBelief,
        ballot: ObjectVotes,
        said: tuple[Hypothesis, ...],
        dt: float,
    ) -> ObjectVotes:
        s = self.settings
        visible = visible_share(mind, belief.id)
        hidden = belief.presence is not Presence.SEEN or visible < s.least_visible
        blind = not {"hypothesis", "region"}.isdisjoint(mind.unknown)
        tau = s.tau_hidden_s if hidden or blind else s.tau_s
        stranger = ballot.stranger * exp(-dt / tau)
        if hidden or blind or not said:
            tally = updated_votes(ballot.tally, {}, dt, tau, s.most_candidates)
            return replace(ballot, tally=tally, stranger=stranger)
        new = 1.0 if ballot.heard is None else min(1.0, (mind.time - ballot.heard) / s.apart_s)
        heard = weights(said, s, awaited(mind, belief.id))
        # Views that do not hang together over time speak against a name (paper, figure 5).
        likely = {n: w * pose_support(mind, belief.id, n) for n, w in heard.items()}
        tally = updated_votes(ballot.tally, likely, dt, tau, s.most_candidates, new * visible)
        stranger += new * visible * _worth(s.stranger, s)
        return replace(ballot, tally=tally, stranger=stranger, heard=mind.time)

    def _believe(self, mind: Mind, belief: ObjectBelief, ballot: ObjectVotes) -> ObjectBelief:
        s = self.settings
        answer = mind.answers.get(belief.id)
        if answer == UNKNOWN_OBJECT:
            return replace(belief, candidates=(), unknown=1.0)
        if answer is not None:
            return replace(
                belief, candidates=(confirmed_candidate(answer, ballot.tally),), unknown=0.0
            )
        return replace(
            belief,
            candidates=candidates(ballot.tally, s, ballot.stranger),
            unknown=unknown_probability(ballot.tally, s, ballot.stranger),
        )

    def _lead(self, ballot: ObjectVotes, named: tuple[Candidate, ...], now: float) -> ObjectVotes:
        s = self.settings
        leader = named[0].name if named and named[0].confidence >= s.settle else None
        since = ballot.leads_since if leader == ballot.leader else now
        settled = leader is not None and now - since >= s.settle_s - 1e-9
        told = leader if settled else ballot.told
        return replace(ballot, leader=leader, leads_since=since, told=told)


def _identified(
    mind: Mind, belief: ObjectBelief, before: str | None, observation: Observation
) -> Event:
    # By its model alone: the part that it plays in a task may be another's, and lags behind.
    words = spaced(called(mind, belief.name))
    if before is None:
        text = f"An object {seems(belief.confidence)} the {words}."
    else:
        was = spaced(called(mind, before))
        text = f"The object taken for the {was} {seems(belief.confidence)} the {words}."
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
