"""The task filter: where a task is, from observations that may be wrong or missing.

One filter supervises and is certified. It is the forward algorithm (`forward_recursion.py`) over hypotheses
that a model gives it: `HiddenPhases`, where the phase of a step is hidden and the posterior exact,
and the model of supervision, which reads the phases off what was seen. It is a probabilistic
parser: the mass of what is followed is the prefix probability of what was seen, the states of the
automaton are the parser's stacks, and equal ones are merged.
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
    """Where a task may be.

    Attributes:
        time: Seconds.
        hypotheses: Each with its probability and the best way to it, the likeliest first.
        lost: How likely it is that the truth was dropped on the way: one minus the product of what
            was retained at each step, each judged by what had been seen until then.
        evidence: Logarithm of how likely all that was seen is, up to what all hypotheses share.
    """

    time: float
    hypotheses: Mapping[K, Weighted[H]]
    lost: float = 0.0
    evidence: float = 0.0

    @property
    def best(self) -> K:
        """The key of the likeliest hypothesis."""
        return next(iter(self.hypotheses))

    @property
    def likeliest(self) -> H:
        """The likeliest hypothesis."""
        return self.hypotheses[self.best].value

    def marginals(self, labels: Callable[[K, H], Iterable[L]]) -> dict[L, float]:
        """For each label the probability of all hypotheses that bear it."""
        found: dict[L, float] = {}
        for key, weighted in self.hypotheses.items():
            for label in labels(key, weighted.value):
                found[label] = found.get(label, 0.0) + weighted.mass
        return found


class TaskModel(Protocol[K, H, E]):
    """How hypotheses about a task arise, and how well observations fit them."""

    @property
    def automaton(self) -> Automaton:
        """The states of the course."""

    def begin(self, now: float) -> Iterable[tuple[K, H, float]]:
        """The hypotheses in which a task may begin, each with its key and its probability."""

    def extended(
        self, posterior: TaskPosterior[K, H], evidence: E, now: float, dt: float
    ) -> Iterator[tuple[K, H, float, float]]:
        """All that may come of the hypotheses in `dt` seconds.

        Yields:
            Key, hypothesis, mass and probability of the best way, both weighted with how well the
            evidence fits. What has the same key is merged.
        """

    def stage_statuses(self, key: K, hypothesis: H) -> Collection[tuple[str, Status]]:
        """The stages under way by a hypothesis, each with its statuses; ("", DONE) at the end."""

    def next_stages(self, key: K, hypothesis: H) -> Mapping[str, float]:
        """For each stage the probability that it is the next to begin; under "" the end."""

    def success(self, key: K, hypothesis: H) -> float:
        """Probability that the course reaches its end from a hypothesis."""


class TaskFilter(Generic[K, H, E]):
    """Follows one task.

    Args:
        model: The model of the task.
        most: How many hypotheses are retained at most.
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
        """The posterior before anything was seen."""
        begun = merged((key, h, share, share) for key, h, share in self.model.begin(now))
        return TaskPosterior(now, pruned(begun, len(begun), 0.0).retained)

    def step(
        self, posterior: TaskPosterior[K, H], evidence: E, dt: float, now: float | None = None
    ) -> TaskPosterior[K, H]:
        """Take in what is seen.

        Args:
            posterior: What was believed; it stays as it is.
            evidence: What is seen, as the model takes it.
            dt: Seconds since the posterior; 0 for the first observation.
            now: Seconds, where that is not `dt` after the posterior: a gap may count as less.
        """
        now = posterior.time + dt if now is None else now
        new = pruned(
            merged(self.model.extended(posterior, evidence, now, dt)), self._most, self._least
        )
        lost = 1.0 - (1.0 - posterior.lost) * (1.0 - new.dropped)
        likelihood = log(new.evidence) if new.evidence > 0.0 else -inf
        return TaskPosterior(now, new.retained, lost, posterior.evidence + likelihood)

    def stages(self, posterior: TaskPosterior[K, H]) -> dict[tuple[str, Status], float]:
        """For each stage and status the probability that a step of it is under way and stands so.

        With steps under way at the same time they sum to more than 1. The end has no stage: it is
        given by an empty name, done.
        """
        return posterior.marginals(self.model.stage_statuses)

    def most_likely(self, posterior: TaskPosterior[K, H]) -> tuple[str, Status]:
        """The most likely stage and status."""
        found = self.stages(posterior)
        return max(found, key=lambda k: found[k])

    def ranking(self, posterior: TaskPosterior[K, H]) -> list[tuple[str, float]]:
        """Stages by the probability that they are under way, the likeliest first."""
        found = posterior.marginals(
            lambda key, h: {stage for stage, _ in self.model.stage_statuses(key, h)}
        )
        return sorted(found.items(), key=lambda item: -item[1])

    def next_stages(self, posterior: TaskPosterior[K, H]) -> list[tuple[str, float]]:
        """Stages by the probability that they are the next to begin, and "" for the end.

        The rest is for what is lost before.
        """
        found: dict[str, float] = {}
        for key, weighted in posterior.hypotheses.items():
            for stage, chance in self.model.next_stages(key, weighted.value).items():
                found[stage] = found.get(stage, 0.0) + weighted.mass * chance
        return sorted(found.items(), key=lambda item: -item[1])

    def success(self, posterior: TaskPosterior[K, H]) -> float:
        """Probability that the course as followed reaches its end under the model."""
        weights = posterior.hypotheses.items()
        return min(1.0, sum(w.mass * self.model.success(key, w.value) for key, w in weights))
