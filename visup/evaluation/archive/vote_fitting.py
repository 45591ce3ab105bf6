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
from visup.evaluation.archive.calibrating import RunTruth
from visup.rules.identity.votes import ObjectVotes, VoteSettings, object_votes
from visup.runs.replay import replay
from visup.runs.settings import MAX_EVIDENCE

LEAST_EVIDENCE = 0.05
SPREAD = 0.5
"""Standard deviation of the prior of the log factor: about two thirds more or less than the shipped value."""
FEWEST = 10
"""Minimum number of labelled objects."""


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
        said = {**self.votes, UNKNOWN_OBJECT: self.none}
        most = max(said.values())
        odds = {name: exp(evidence * (v - most)) for name, v in said.items()}
        true = odds.get(self.truth, exp(-evidence * most))
        return true / (sum(odds.values()) + (0.0 if self.truth in odds else true))


def fitted_evidence(labelled: Sequence[LabelledVotes]) -> float | None:
    """The fitted weight of a vote; None with too few labelled objects.

    >>> sure = LabelledVotes({"arm": 2.0, "cup": 1.0}, 0.5, "arm")
    >>> wrong = LabelledVotes({"arm": 2.0, "cup": 1.0}, 0.5, "cup")
    >>> fitted_evidence([sure, wrong] * 10) < VoteSettings().evidence < fitted_evidence([sure] * 20)
    True
    """
    if len(labelled) < FEWEST:
        return None
    usual = log(VoteSettings().evidence)

    def cost(x: float) -> float:
        misfit = -sum(log(max(1e-12, one.likelihood(exp(x)))) for one in labelled)
        return misfit + 0.5 * ((x - usual) / SPREAD) ** 2

    found = minimize_scalar(cost, bounds=(log(LEAST_EVIDENCE), log(MAX_EVIDENCE)), method="bounded")
    return float(exp(found.x))


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

        def look(step: Step) -> None:
            nonlocal mind
            mind = step.mind

        replay(*lake.recorded(run), on_step=look)
        for number, belief in sorted(mind.objects.items()):
            name = truth[run].objects.get(str(number))
            counted = object_votes(mind, number)
            if name is not None and belief.confirmed and counted.last_matched is not None:
                yield _labelled(counted, name)


def _labelled(counted: ObjectVotes, name: str) -> LabelledVotes:
    return LabelledVotes(dict(counted.counts), counted.none, name)
