"""Fits the weight of identity votes to labelled runs (temperature scaling).

Confidence is a softmax over votes (`rules/identity/votes.py`) with one factor, the weight of a vote. It is
fitted by maximum likelihood with a prior around the shipped value, since a few labels carry little
information.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import exp, log

from scipy.optimize import minimize_scalar

from visup.agent import Mind
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.agent.model.step import Step
from visup.archive.lake import Lake
from visup.evaluation.archive.reliability import RunTruth
from visup.rules.identity.votes import ObjectVotes, VoteSettings, object_votes
from visup.runs.replay import replay
from visup.runs.settings import MAX_EVIDENCE

MIN_EVIDENCE = 0.05
PRIOR_SIGMA = 0.5
"""Standard deviation of the log-normal prior: about two thirds more or less than the shipped value."""
MIN_LABELLED = 10
"""Minimum number of labelled objects; with fewer the prior alone would decide."""


@dataclass(frozen=True, slots=True)
class LabelledVotes:
    """The final votes of an object, and its true identity.

    Attributes:
        votes: Votes by name.
        none: Votes for none of the models.
        truth: The model, or 'unknown object'.
    """

    votes: Mapping[str, float]
    none: float
    truth: str

    def likelihood(self, evidence: float) -> float:
        """The probability of the truth for a weight of votes."""
        votes = {**self.votes, UNKNOWN_OBJECT: self.none}
        max_votes = max(votes.values())
        odds = {name: exp(evidence * (v - max_votes)) for name, v in votes.items()}
        true_odds = odds.get(self.truth, exp(-evidence * max_votes))
        return true_odds / (sum(odds.values()) + (0.0 if self.truth in odds else true_odds))


def fitted_evidence(labelled: Sequence[LabelledVotes]) -> float | None:
    """The fitted weight of a vote; None with too few labelled objects.

    >>> sure = LabelledVotes({"arm": 2.0, "cup": 1.0}, 0.5, "arm")
    >>> wrong = LabelledVotes({"arm": 2.0, "cup": 1.0}, 0.5, "cup")
    >>> fitted_evidence([sure, wrong] * 10) < VoteSettings().evidence < fitted_evidence([sure] * 20)
    True
    """
    if len(labelled) < MIN_LABELLED:
        return None
    default_log = log(VoteSettings().evidence)

    def cost(log_evidence: float) -> float:
        loss = -sum(log(max(1e-12, votes.likelihood(exp(log_evidence)))) for votes in labelled)
        return loss + 0.5 * ((log_evidence - default_log) / PRIOR_SIGMA) ** 2

    minimum = minimize_scalar(cost, bounds=(log(MIN_EVIDENCE), log(MAX_EVIDENCE)), method="bounded")
    return float(exp(minimum.x))


def labelled_votes(lake: Lake, truth: Mapping[str, RunTruth]) -> Iterator[LabelledVotes]:
    """The final votes of the confirmed and labelled objects of a lake.

    Args:
        lake: The lake, whose runs are replayed.
        truth: Run -> its truth.

    Raises:
        VisupError: A run is damaged.
    """
    for run in sorted(truth):
        if not truth[run].objects:
            continue
        mind = Mind()

        def keep_mind(step: Step) -> None:
            nonlocal mind
            mind = step.mind

        replay(*lake.recorded(run), on_step=keep_mind)
        for number, belief in sorted(mind.objects.items()):
            name = truth[run].objects.get(str(number))
            votes = object_votes(mind, number)
            if name is not None and belief.confirmed and votes.last_matched is not None:
                yield _labelled(votes, name)


def _labelled(votes: ObjectVotes, name: str) -> LabelledVotes:
    return LabelledVotes(dict(votes.counts), votes.none, name)
