"""How much a vote for an identity tells, fitted to labelled runs: the temperature of its confidences.

Confidence is a softmax over votes (`rules/identity/votes.py`); its one factor says how fast votes become
certainty. It is chosen so that what is true was the likeliest to be said. A few labels say little, so that
what visup ships with counts as if it had been fitted to some of its own.
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
from visup.runs.settings import LARGEST_EVIDENCE

LEAST_EVIDENCE = 0.05
SPREAD = 0.5
"""How far, as a logarithm, the right factor may well be from the shipped one: by two thirds more, or less."""
FEWEST = 10
"""Of fewer labelled objects nothing is fitted."""


@dataclass(frozen=True, slots=True)
class LabelledVotes:
    """The votes of an object at last, and what it truly is.

    Attributes:
        votes: Of each name.
        none: For its being none of the models.
        truth: The model, or 'unknown object'.
    """

    votes: Mapping[str, float]
    none: float
    truth: str

    def likelihood(self, evidence: float) -> float:
        """How likely the truth was called, where a vote tells so much."""
        said = {**self.votes, UNKNOWN_OBJECT: self.none}
        most = max(said.values())
        odds = {name: exp(evidence * (v - most)) for name, v in said.items()}
        true = odds.get(self.truth, exp(-evidence * most))
        return true / (sum(odds.values()) + (0.0 if self.truth in odds else true))


def fitted_evidence(labelled: Sequence[LabelledVotes]) -> float | None:
    """How much a vote tells, by labelled objects; None where there are too few.

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

    found = minimize_scalar(
        cost, bounds=(log(LEAST_EVIDENCE), log(LARGEST_EVIDENCE)), method="bounded"
    )
    return float(exp(found.x))


def labelled_votes(lake: Lake, truth: Mapping[str, RunTruth]) -> Iterator[LabelledVotes]:
    """The votes of the confirmed objects of a lake that are labelled, at the ends of their runs.

    Args:
        lake: The runs are reasoned about again.
        truth: Run -> what is true of it.

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

        replay(*lake.recorded(run), tell=look)
        for number, belief in sorted(mind.objects.items()):
            name = truth[run].objects.get(str(number))
            counted = object_votes(mind, number)
            if name is not None and belief.confirmed and counted.heard is not None:
                yield _labelled(counted, name)


def _labelled(counted: ObjectVotes, name: str) -> LabelledVotes:
    return LabelledVotes(dict(counted.counts), counted.none, name)
