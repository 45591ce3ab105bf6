"""The weighted, occlusion-sensitive, time-discounted vote (paper, section 5, figure 5).

For each object o and each model name n, in each step of length dt:

    v(o, n) <- v(o, n) * exp(-dt / tau) + w
    w = new * visible(o) * p(o, n) * rank^k * (s - 0.4) / (1 - 0.4)

where s is the best similarity with which any view of n was hypothesised for o's region in this step (nothing
at or below 0.4 counts; section 7.3), k the rank of n among the names of this step (0 for the best), p(o, n)
the consistency of its views over time (`pose_support`; 1 while the border cuts o), and visible(o) the visible
share of o. Hypotheses in quick succession are not independent, since they see almost the same image: `new` is
the time since the last ones, as a share of `apart_s`, at most 1. The three principles:

1. recurrent and temporally stable hypotheses are more likely: votes accumulate over steps;
2. hypotheses that do not recur are forgotten: votes decay with `tau_s`;
3. an occluded object keeps its votes for some time: while it is hidden, or the camera is blind,
   they decay with `tau_hidden_s` instead.

The set of names is open. Whatever is in view, the database has something slightly similar: in each step the
possibility that the object is none of the models gets the vote of a name of similarity `stranger`. While it
has the most votes, because all names are weak or change constantly, the object is an 'unknown object'.

Matches of a silhouette are counted separately from those of the behaviour that detected the object. A model
that a task expects, and that no other object is believed to be (*awaited*), is more likely a priori: it
counts as more similar, since errors of similarity last as long as the view, and has some votes from the
start. Votes are log evidence: the likelihood of a name is proportional to exp(`evidence` * v).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from math import exp
from types import MappingProxyType

from visup.agent import Candidate, Hypothesis, Mind
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey

VoteCounts = tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class MatchKind:
    """Settings of one kind of match.

    Attributes:
        awaited: Bonus to the similarity of a model of a task's actor, while no other object is believed
            to be it.
    """

    awaited: float


@dataclass(frozen=True, slots=True)
class VoteSettings:
    """Settings of the vote.

    Attributes:
        least_similarity: Hypotheses at or below this similarity do not count (paper: 0.4).
        tau_s: Time constant of the decay of votes on a visible object, seconds.
        tau_hidden_s: The same for a hidden object.
        rank: Weight of each name relative to the name above it in the same step.
        least_visible: Below this visible share an object is treated as hidden.
        most_candidates: Most names of an object.
        least_share: Names with a smaller share of the votes are dropped.
        known_votes: Votes that the best name needs for the object to be known at all.
        unknown_similarity: Similarity that an object has to some model even if it is none of them.
        shape: Settings of matches of the silhouette.
        found: Settings of matches by the behaviour that detected the region.
        awaited_votes: Prior votes of an awaited model, unless the behaviour that detected the object has
            votes.
        independent_s: Interval from which successive hypotheses count in full, seconds.
        evidence: Log likelihood per vote.
        report_likelihood: Likelihood from which a name is reported.
        report_s: How long it must have had that likelihood, seconds.
    """

    least_similarity: float = 0.4
    tau_s: float = 6.0
    tau_hidden_s: float = 60.0
    rank: float = 0.8
    least_visible: float = 0.5
    most_candidates: int = 5
    least_share: float = 0.03
    known_votes: float = 0.3
    unknown_similarity: float = 0.5
    shape: MatchKind = MatchKind(awaited=0.1)
    found: MatchKind = MatchKind(awaited=0.06)
    awaited_votes: float = 4.0
    independent_s: float = 0.2
    evidence: float = 2.2
    report_likelihood: float = 0.7
    report_s: float = 0.8


@dataclass(frozen=True, slots=True)
class Tally:
    """Votes of one kind of match for an object.

    Attributes:
        counts: (name, votes), most votes first.
        none: Votes for its being none of the models.
    """

    counts: VoteCounts = ()
    none: float = 0.0


@dataclass(frozen=True)
class ObjectVotes:
    """The memory of one object's votes.

    Attributes:
        counts: (name, votes), most votes first, summed over all kinds of matches.
        none: Votes for its being none of the models.
        shape: Votes of matches of its silhouette.
        found: Votes of matches by the behaviour that detected it.
        last_matched: Time of the last hypotheses about it, seconds, or None.
        leader: The name whose likelihood is at least `report_likelihood` now, or None.
        leads_since: Time since when `leader` has its value, seconds.
        reported: The last reported name, or None.
    """

    counts: VoteCounts = ()
    none: float = 0.0
    shape: Tally = Tally()
    found: Tally = Tally()
    last_matched: float | None = None
    leader: str | None = None
    leads_since: float = 0.0
    reported: str | None = None


@dataclass(frozen=True, slots=True)
class VoteMemory:
    """All votes.

    Attributes:
        time: Seconds of the last count.
        votes: Object id -> its votes.
    """

    time: float
    votes: Mapping[int, ObjectVotes] = field(default_factory=lambda: MappingProxyType({}))


VOTES: MemoryKey[VoteMemory | None] = MemoryKey("rules.votes", None)


def object_votes(mind: Mind, object_id: int) -> ObjectVotes:
    """The memory of the votes on an object."""
    memory = mind.recall(VOTES) or VoteMemory(mind.time)
    return memory.votes.get(object_id, ObjectVotes())


def weights(
    hypotheses: tuple[Hypothesis, ...],
    settings: VoteSettings,
    awaited: Collection[str] = (),
    more: float = 0.0,
) -> dict[str, float]:
    """Weights of the names hypothesised for one region in one step.

    Args:
        hypotheses: All of them, in any order.
        settings: Threshold and rank discount.
        awaited: Models that are expected and not yet found.
        more: Bonus to their similarity.

    Returns:
        Name -> weight, 0 to 1, best first.
    """
    best: dict[str, float] = {}
    for h in hypotheses:
        if h.similarity > settings.least_similarity:
            similarity = min(1.0, h.similarity + more * (h.name in awaited))
            best[h.name] = max(best.get(h.name, 0.0), similarity)
    ranked = sorted(best.items(), key=lambda item: (-item[1], item[0]))
    return {
        name: settings.rank**k * similarity_weight(s, settings)
        for k, (name, s) in enumerate(ranked)
    }


def similarity_weight(similarity: float, settings: VoteSettings) -> float:
    """The weight of a similarity, 0 to 1."""
    room = 1.0 - settings.least_similarity
    return max(0.0, similarity - settings.least_similarity) / room


def update_votes(
    tally: VoteCounts,
    new: Mapping[str, float],
    dt: float,
    tau: float,
    most: int,
    visible: float = 1.0,
) -> VoteCounts:
    """One step of the vote for one object.

    Args:
        tally: Votes before the step.
        new: Weights of this step's names.
        dt: Seconds since the last count.
        tau: Time constant, seconds.
        most: Names to keep.
        visible: Visible share of the object, 0 to 1.

    Returns:
        Votes after the step, most first.
    """
    fade = exp(-dt / tau)
    votes = {name: v * fade for name, v in tally}
    for name, weight in new.items():
        votes[name] = votes.get(name, 0.0) + visible * weight
    ranked = sorted(votes.items(), key=lambda item: (-item[1], item[0]))
    return tuple((n, v) for n, v in ranked[: 2 * most] if v > 1e-4)


def candidates(
    tally: VoteCounts, settings: VoteSettings, unknown_votes: float = 0.0
) -> tuple[Candidate, ...]:
    """Candidates supported by votes, each with its likelihood.

    Args:
        tally: Votes, most first.
        settings: Number of candidates, and the scale of votes.
        unknown_votes: Votes for the object's being none of the models.

    Returns:
        Most likely first; empty while the best name has too few votes, or fewer than `unknown_votes`.
    """
    if not tally or tally[0][1] <= 0.0 or tally[0][1] < max(settings.known_votes, unknown_votes):
        return ()
    total = sum(v for _, v in tally)
    odds = [exp(settings.evidence * (v - tally[0][1])) for _, v in tally]
    whole = sum(odds) + exp(settings.evidence * (unknown_votes - tally[0][1]))
    found = (
        Candidate(name, v, v / total, o / whole)
        for (name, v), o in zip(tally[: settings.most_candidates], odds, strict=False)
    )
    return tuple(c for c in found if c.share >= settings.least_share)


def unknown_probability(tally: VoteCounts, settings: VoteSettings, unknown_votes: float) -> float:
    """Probability that an object is none of the models, 0 to 1; 1 without votes on a name.

    Args:
        tally: Votes on names.
        settings: Scale of votes.
        unknown_votes: Votes for the object's being none of the models.
    """
    odds = sum(exp(settings.evidence * (v - unknown_votes)) for _, v in tally)
    return 1.0 / (1.0 + odds)


def confirmed_candidate(name: str, tally: VoteCounts) -> Candidate:
    """The only candidate of an object identified by the operator."""
    return Candidate(name, dict(tally).get(name, 0.0), 1.0, 1.0)


def update_tally(
    tally: Tally, new: Tally, share: float, fade: tuple[float, float], most: int
) -> Tally:
    """Update a tally by one step.

    Args:
        tally: The tally before.
        new: Weights of this step's names and of none of the models; empty without a match.
        share: Factor on these weights, 0 to 1.
        fade: (time since the last count, time constant), seconds.
        most: Names to keep.
    """
    if not (tally.counts or tally.none or new.counts):
        return tally
    counts = update_votes(tally.counts, dict(new.counts), *fade, most, share)
    return Tally(counts, tally.none * exp(-fade[0] / fade[1]) + share * new.none)


def total_votes(
    votes: ObjectVotes, settings: VoteSettings, awaited: Collection[str]
) -> ObjectVotes:
    """The votes on an object with `counts` and `none` summed over all kinds of matches.

    Args:
        votes: Votes with the updated tally of each kind.
        settings: Settings, for the prior votes of awaited models.
        awaited: Models that are expected and not yet found.
    """
    kinds = votes.shape, votes.found
    total: dict[str, float] = {}
    for tally in kinds:
        for name, v in tally.counts:
            total[name] = total.get(name, 0.0) + v
    if not votes.found.counts:
        for name in total.keys() & awaited:
            total[name] += settings.awaited_votes
    counts = tuple(sorted(total.items(), key=lambda item: (-item[1], item[0])))
    return replace(votes, counts=counts, none=sum(t.none for t in kinds))
