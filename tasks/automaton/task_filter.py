"""The task filter: estimates the state of a task from observations that may be wrong or missing.

The same filter is used for supervision and verified exactly. It is the forward algorithm
(`forward_recursion.py`) over the hypotheses of a model: `HiddenPhases`, with hidden phases and an exact
posterior, or the model of supervision, which derives the phases from the observations. It is a probabilistic
parser: the total mass is the prefix probability of the observations, the states of the automaton are the
parser's stacks, and equal ones are merged.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import inf, log
from typing import Generic, Protocol, TypeVar

from visup.agent import Status
from visup.tasks.automaton.automaton import Automaton
from visup.tasks.automaton.forward_recursion import Weighted, merged, pruned

K = TypeVar("K", bound=Hashable)
H = TypeVar("H")
E = TypeVar("E", contravariant=True)
L = TypeVar("L", bound=Hashable)


@dataclass(frozen=True, slots=True)
class TaskPosterior(Generic[K, H]):
    """The posterior of the state of a task.

    Attributes:
        time: Time of the last observation, seconds.
        hypotheses: Hypotheses with their probabilities and best paths, most likely first.
        lost: Probability that the truth was dropped: one minus the product of the mass retained at each step,
            given the observations up to that step.
        evidence: Log-likelihood of all observations, up to a term common to all hypotheses.
    """

    time: float
    hypotheses: Mapping[K, Weighted[H]]
    lost: float = 0.0
    evidence: float = 0.0

    @property
    def best(self) -> K:
        """The key of the most likely hypothesis."""
        return next(iter(self.hypotheses))

    @property
    def likeliest(self) -> H:
        """The most likely hypothesis."""
        return self.hypotheses[self.best].value

    def marginals(self, labels: Callable[[K, H], Iterable[L]]) -> dict[L, float]:
        """Label -> total probability of the hypotheses with it."""
        found: dict[L, float] = {}
        for key, weighted in self.hypotheses.items():
            for label in labels(key, weighted.value):
                found[label] = found.get(label, 0.0) + weighted.mass
        return found


class TaskModel(Protocol[K, H, E]):
    """Generates hypotheses about a task and their likelihoods."""

    @property
    def automaton(self) -> Automaton:
        """The states of the course."""

    def begin(self, now: float) -> Iterable[tuple[K, H, float]]:
        """The initial hypotheses with their keys and probabilities."""

    def extended(
        self, posterior: TaskPosterior[K, H], evidence: E, now: float, dt: float
    ) -> Iterator[tuple[K, H, float, float]]:
        """All successors of the hypotheses after `dt` seconds.

        Yields:
            Key, hypothesis, mass and probability of the best path, both weighted by the likelihood of the
            evidence. Equal keys are merged.
        """

    def stage_statuses(self, key: K, hypothesis: H) -> Collection[tuple[str, Status]]:
        """The active stages of a hypothesis with their statuses; ("", DONE) at the end."""

    def next_stages(self, key: K, hypothesis: H) -> Mapping[str, float]:
        """Stage -> probability that it is the next to begin; "" for the end."""

    def success(self, key: K, hypothesis: H) -> float:
        """Probability that the course reaches its end from a hypothesis."""


class TaskFilter(Generic[K, H, E]):
    """Filters the state of one task.

    Args:
        model: The model of the task.
        most: Maximum number of hypotheses.
        least: Hypotheses with a smaller probability are dropped; 0 for the exact posterior.
    """

    def __init__(self, model: TaskModel[K, H, E], most: int = 1_000, least: float = 1e-6) -> None:
        self.model = model
        self._most, self._least = most, least

    @property
    def automaton(self) -> Automaton:
        """The states of the course."""
        return self.model.automaton

    def start(self, now: float = 0.0) -> TaskPosterior[K, H]:
        """The prior before the first observation."""
        begun = merged((key, h, share, share) for key, h, share in self.model.begin(now))
        return TaskPosterior(now, pruned(begun, len(begun), 0.0).retained)

    def step(
        self, posterior: TaskPosterior[K, H], evidence: E, dt: float, now: float | None = None
    ) -> TaskPosterior[K, H]:
        """Update the posterior with an observation.

        Args:
            posterior: The previous posterior, which is not modified.
            evidence: The observation in the form of the model.
            dt: Time since the posterior, seconds; 0 for the first observation.
            now: Time of the observation, seconds, if it is not `dt` after the posterior: of a long gap in the
                frames, `dt` may be only a part.
        """
        now = posterior.time + dt if now is None else now
        new = pruned(
            merged(self.model.extended(posterior, evidence, now, dt)), self._most, self._least
        )
        lost = 1.0 - (1.0 - posterior.lost) * (1.0 - new.dropped)
        likelihood = log(new.evidence) if new.evidence > 0.0 else -inf
        return TaskPosterior(now, new.retained, lost, posterior.evidence + likelihood)

    def stages(self, posterior: TaskPosterior[K, H]) -> dict[tuple[str, Status], float]:
        """(Stage, status) -> probability that a step of the stage is active with this status.

        With parallel steps they sum to more than 1. The end has an empty name and status DONE.
        """
        return posterior.marginals(self.model.stage_statuses)

    def most_likely(self, posterior: TaskPosterior[K, H]) -> tuple[str, Status]:
        """The most likely stage and status."""
        found = self.stages(posterior)
        return max(found, key=lambda k: found[k])

    def ranking(self, posterior: TaskPosterior[K, H]) -> list[tuple[str, float]]:
        """Stages by the probability that they are active, most likely first."""
        found = posterior.marginals(
            lambda key, h: {stage for stage, _ in self.model.stage_statuses(key, h)}
        )
        return sorted(found.items(), key=lambda item: -item[1])

    def next_stages(self, posterior: TaskPosterior[K, H]) -> list[tuple[str, float]]:
        """Stages by the probability that they are the next to begin, and "" for the end.

        The rest of 1 is the probability of being lost before.
        """
        found: dict[str, float] = {}
        for key, weighted in posterior.hypotheses.items():
            for stage, chance in self.model.next_stages(key, weighted.value).items():
                found[stage] = found.get(stage, 0.0) + weighted.mass * chance
        return sorted(found.items(), key=lambda item: -item[1])

    def success(self, posterior: TaskPosterior[K, H]) -> float:
        """Probability that the course reaches its end under the model."""
        weights = posterior.hypotheses.items()
        return min(1.0, sum(w.mass * self.model.success(key, w.value) for key, w in weights))
