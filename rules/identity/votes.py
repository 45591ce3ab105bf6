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

from collections.abc import Collection, Iterator, Mapping, Sequence
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
from visup.agent.model.memory import MemoryKey
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.rules.pose.reasoner import pose_support
from visup.rules.presence.association import hypotheses_by_object
from visup.rules.presence.reasoner import visible_share
from visup.rules.wording.conditions import Condition, DecisionLog, at_least, decide
from visup.rules.wording.sentences import (
    KIND_NAMES,
    TOLD_NAMES,
    seems,
    with_article,
)

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
        counts: (name, votes), most votes first.
        none: Votes for its being none of the models.
        heard: Seconds of the last hypotheses about it, or None.
        leader: The name that leads clearly now, or None.
        leads_since: Seconds since when it does.
        reported: The name that was reported last, or None.
    """

    counts: VoteCounts = ()
    none: float = 0.0
    heard: float | None = None
    leader: str | None = None
    leads_since: float = 0.0
    reported: str | None = None


@dataclass(frozen=True, slots=True)
class VoteMemory:
    """All votes.

    Attributes:
        time: Seconds of the last count.
        of: Object id -> its votes.
    """

    time: float
    of: Mapping[int, ObjectVotes] = field(default_factory=lambda: MappingProxyType({}))


VOTES: MemoryKey[VoteMemory | None] = MemoryKey("rules.votes", None)


def object_votes(mind: Mind, object_id: int) -> ObjectVotes:
    """What is remembered of the votes on an object."""
    memory = mind.recall(VOTES) or VoteMemory(mind.time)
    return memory.of.get(object_id, ObjectVotes())


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


def answered_model(mind: Mind, answer: str) -> str:
    """The model that an answer means: the first of an actor's, where the answer names an actor."""
    bindings = (b for task in mind.tasks for b in task.bindings if b.actor == answer)
    return next((b.models[0] for b in bindings if b.models), answer)


def confirmed_candidate(name: str, tally: VoteCounts) -> Candidate:
    """The only candidate, once the operator has said what an object is."""
    return Candidate(name, dict(tally).get(name, 0.0), 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class IdentityReasoner:
    """Reasoner of the cogitate phase: counts votes and tells who is who."""

    settings: VoteSettings = VoteSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Count one step; see `Reasoner`."""
        return self._judged(mind, observation, None)

    def explain(self, mind: Mind, observation: Observation) -> DecisionLog:
        """What the decision 'identified' of a step hangs on, for every object.

        Args:
            mind: As this reasoner got it in that step.
            observation: What was perceived.
        """
        log = DecisionLog()
        self._judged(mind, observation, log)
        return log

    def _judged(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        old = mind.recall(VOTES) or VoteMemory(observation.time)
        dt = max(0.0, observation.time - old.time)
        hypotheses = hypotheses_by_object(mind, observation)
        mind = _with_kinds(mind, hypotheses)
        every: dict[int, ObjectVotes] = {}
        events: list[Event] = []
        beliefs: list[ObjectBelief] = []
        for object_id, belief in sorted(mind.objects.items()):
            before = old.of.get(object_id, ObjectVotes())
            votes = self._count(mind, belief, before, hypotheses.get(object_id, ()), dt)
            believed = self._believe(mind, belief, votes)
            beliefs.append(believed)
            votes = self._lead(votes, believed.candidates, observation.time)
            if decide(self._conditions(believed, votes, mind), log, "identified", (object_id,)):
                now = mind.with_objects(believed)
                events.append(_identified(now, believed, votes.reported, observation))
                votes = replace(votes, reported=votes.leader)
            every[object_id] = votes
        mind = mind.with_objects(*beliefs)
        mind = mind.remember(VOTES, VoteMemory(observation.time, MappingProxyType(every)))
        told = {i: votes.reported for i, votes in every.items() if votes.reported is not None}
        mind = mind.remember(TOLD_NAMES, MappingProxyType(told))
        return Outcome(mind, tuple(events))

    def _conditions(
        self, belief: ObjectBelief, votes: ObjectVotes, mind: Mind
    ) -> Iterator[Condition]:
        """Of an object's being identified as what leads its votes."""
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
        yield at_least(f"likelihood of {name}", belief.confidence, s.settle)
        yield at_least("leads for", mind.time - votes.leads_since, s.settle_s, " s", slack=1e-9)
        yield Condition("it has entered", belief.confirmed)

    def _count(
        self,
        mind: Mind,
        belief: ObjectBelief,
        votes: ObjectVotes,
        hypotheses: tuple[Hypothesis, ...],
        dt: float,
    ) -> ObjectVotes:
        s = self.settings
        visible = visible_share(mind, belief.id)
        hidden = belief.presence is not Presence.SEEN or visible < s.least_visible
        blind = not {"hypothesis", "region"}.isdisjoint(mind.unknown)
        tau = s.tau_hidden_s if hidden or blind else s.tau_s
        none = votes.none * exp(-dt / tau)
        if hidden or blind or not hypotheses:
            counts = updated_votes(votes.counts, {}, dt, tau, s.most_candidates)
            return replace(votes, counts=counts, none=none)
        new = 1.0 if votes.heard is None else min(1.0, (mind.time - votes.heard) / s.apart_s)
        heard = weights(hypotheses, s, awaited(mind, belief.id))
        # Views that do not hang together over time speak against a name (paper, figure 5).
        likely = {n: w * pose_support(mind, belief.id, n) for n, w in heard.items()}
        counts = updated_votes(votes.counts, likely, dt, tau, s.most_candidates, new * visible)
        none += new * visible * _worth(s.stranger, s)
        return replace(votes, counts=counts, none=none, heard=mind.time)

    def _believe(self, mind: Mind, belief: ObjectBelief, votes: ObjectVotes) -> ObjectBelief:
        s = self.settings
        answer = mind.answers.get(belief.id)
        if answer == UNKNOWN_OBJECT:
            return replace(belief, candidates=(), unknown=1.0)
        if answer is not None:
            name = answered_model(mind, answer)
            said = (confirmed_candidate(name, votes.counts),)
            return replace(belief, candidates=said, unknown=0.0)
        return replace(
            belief,
            candidates=candidates(votes.counts, s, votes.none),
            unknown=unknown_probability(votes.counts, s, votes.none),
        )

    def _lead(self, votes: ObjectVotes, named: tuple[Candidate, ...], now: float) -> ObjectVotes:
        """The votes with who leads clearly, and since when."""
        clear = named and named[0].confidence >= self.settings.settle
        leader = named[0].name if clear else None
        since = votes.leads_since if leader == votes.leader else now
        return replace(votes, leader=leader, leads_since=since)


def _with_kinds(mind: Mind, hypotheses: Mapping[int, Sequence[Hypothesis]]) -> Mind:
    """The mind that knows which names are those of kinds."""
    heard = {h.name for said in hypotheses.values() for h in said if h.of_kind}
    known = mind.recall(KIND_NAMES)
    return (
        mind if heard <= set(known) else mind.remember(KIND_NAMES, (*sorted(heard | set(known)),))
    )


def _identified(
    mind: Mind, belief: ObjectBelief, before: str | None, observation: Observation
) -> Event:
    # By its model alone: the part that it plays in a task may be another's, and lags behind.
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
