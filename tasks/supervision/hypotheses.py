"""Readings: the courses that what was seen may have taken through a task, side by side.

A hypothesis is one state of the course with what is kept about the steps under way and the stages that
lie behind it. Its mass is the probability of all that leads to it, by the forward algorithm
(`forward.py`) with the probabilities of the model (`hmm.py`): hypotheses of the same state are
merged, their masses add up. The phase of a step is not guessed at here: it is read off what is kept
about it (`verify.py`), so that what is told of a step can be accounted for. The likeliest hypothesis
is what supervision tells, and its mass is how sure that is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from visup.agent import Relation, StageBelief, Status, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.vocabulary import FactEvaluator
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import Backpointer, extended
from visup.tasks.automaton.derivatives import Leaf, State, TaskStep, leaves, with_leaves
from visup.tasks.automaton.forward import merged, pruned
from visup.tasks.automaton.prognosis import Prognosis, begun_by
from visup.tasks.automaton.stage_hmm import SUPERVISION_HMM, WAITING, ActionStatus, StageHmm
from visup.tasks.automaton.transitions import HiddenState
from visup.tasks.grammar.nodes import Task
from visup.tasks.supervision.advance import Onward, Paths
from visup.tasks.supervision.sentences import outcome
from visup.tasks.verification.observe import ActionObservation
from visup.tasks.verification.settings import TaskSettings
from visup.tasks.verification.step_monitor import BAD, StepMonitor, entered, over, update

LEAST = 1e-13  # a hypothesis with less of the mass is given up

WORSE = {Status.DONE: 0, Status.UNKNOWN: 1, Status.FAILED: 2}  # the worst ending is told last

# How strongly something speaks for a way on; each time that this rises, it is chosen or not.
NEARER, OVER, BEGUN = 1, 2, 3

Observe = Callable[[TaskStep], ActionObservation]


@dataclass(frozen=True)
class TaskHypothesis:
    """One course that what was seen may have taken.

    Attributes:
        state: Where it is.
        node: The number of that state (see `Automaton`).
        mass: Its probability, given all that was seen.
        best: Probability of the best single way to it, relative to that of all.
        past: Stages that lie behind it, the latest word on each.
        finished: When the task was done by it, or None.
        met: Steps that may come next and whose entry was seen, with the time when it last was.
        weighed: Ways on that were not taken, by their steps, and how strongly they were spoken for.
        trail: The steps that lie behind it, and when each was left.
        gone_on: Whether it has left a step.
    """

    state: State[StepMonitor]
    node: int
    mass: float = 1.0
    best: float = 1.0
    past: tuple[StageBelief, ...] = ()
    finished: float | None = None
    met: tuple[tuple[tuple[TaskStep, ...], float], ...] = ()
    weighed: tuple[tuple[tuple[TaskStep, ...], int], ...] = ()
    backpointer: Backpointer | None = None
    gone_on: bool = False

    @property
    def begun(self) -> bool:
        """Whether anything of the task was seen by it."""
        return self.gone_on or any(x.payload.begun is not None for x in leaves(self.state))

    def times(self, factor: float) -> TaskHypothesis:
        """The same hypothesis, so much likelier."""
        return replace(self, mass=self.mass * factor, best=self.best * factor)


@dataclass(frozen=True)
class HypothesisTracker:
    """What following the hypotheses of one task needs.

    Attributes:
        task: The task.
        actions: Meanings of its actions, with those of comparisons and zones (see `task_vocabulary`).
        settings: Patience.
        looks: Whether what is no plain relation of the mind holds.
        hmm: The probabilities of the model.
    """

    task: Task
    actions: Mapping[str, ActionDefinition]
    settings: TaskSettings
    looks: Mapping[str, FactEvaluator] = field(default_factory=dict)
    hmm: StageHmm = SUPERVISION_HMM

    @cached_property
    def automaton(self) -> Automaton:
        """The states of the course, worked out as they are come to."""
        return Automaton(self.task)

    @cached_property
    def prognosis(self) -> Prognosis:
        """What the model expects of the rest of the task."""
        return Prognosis(self.automaton, self.hmm)

    @cached_property
    def _paths(self) -> Paths:
        return Paths(self.task, self.automaton)

    def start(self, now: float) -> tuple[TaskHypothesis, ...]:
        """The hypotheses in which the task begins now."""
        found = self._paths.begin(now)
        return tuple(TaskHypothesis(state, node, 1.0 / len(found)) for state, node in found)

    @cached_property
    def first_steps(self) -> tuple[TaskStep, ...]:
        """The steps with which the task may begin, whenever that is."""
        return tuple(self._paths.first_steps())

    def asked_for(self, node: int) -> tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]:
        """What is asked for at a node of the automaton: actors, and relations between these.

        Of each step under way what it holds and expects, of each that may come next its beginning.
        """
        if node not in self._asked_for:
            self._asked_for[node] = tuple(self._asking(node))
        return self._asked_for[node]

    @cached_property
    def _asked_for(self) -> dict[int, tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]]:
        return {}

    def _asking(self, node: int) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
        for step in self.automaton.steps(node):
            meaning = self.actions[step.action]
            yield step.actors, (meaning.name, *meaning.holds, *meaning.expects)
        for transition in self.automaton.transitions(node):
            for step in begun_by(self.automaton, transition):
                yield step.actors, self.actions[step.action].begins

    def onward(self, hypothesis: TaskHypothesis, now: float) -> list[Onward]:
        """The ways on from a hypothesis."""
        return self._paths.onward(hypothesis.state, hypothesis.node, now)

    def follow(
        self, hypotheses: tuple[TaskHypothesis, ...], see: Observe, now: float, dt: float
    ) -> tuple[TaskHypothesis, ...]:
        """Take what is seen now into all hypotheses.

        Args:
            hypotheses: As they were.
            see: What is seen now of a step.
            now: Seconds.
            dt: Seconds since the last time.

        Returns:
            At most `most_courses` hypotheses, the likeliest first; their masses sum to 1.
        """
        aged = [self._age(r, see, now, dt) for r in hypotheses]
        grown = (n for r in aged for n in self._go_on(r, see, now, dt))
        found = merged((r.node, r, r.mass, r.best) for r in grown)
        kept = pruned(found, self.settings.most_courses, LEAST).retained.values()
        ranked = sorted(kept, key=lambda w: -w.mass)
        return tuple(replace(w.value, mass=w.mass, best=w.best) for w in ranked)

    def next_stages(self, hypotheses: tuple[TaskHypothesis, ...]) -> dict[str, float]:
        """For each stage the probability that it is the next to begin; the rest is for the end."""
        found: dict[str, float] = {}
        for hypothesis in hypotheses:
            if hypothesis.finished is None:
                for stage, chance in self.prognosis.next_stages(hypothesis.node).items():
                    found[stage] = found.get(stage, 0.0) + hypothesis.mass * chance
        return found

    def success(self, hypotheses: tuple[TaskHypothesis, ...]) -> float:
        """Probability that the course as followed reaches its end, with no stage failed for good."""
        hopes = (
            r.mass * self.prognosis.success(self.place(r))
            for r in hypotheses
            if all(p.status is not Status.FAILED for p in r.past)
        )
        return min(1.0, sum(hopes))

    def gain(self, hypothesis: TaskHypothesis, see: Observe) -> float:
        """The evidence of a second that a task is going on, as a hypothesis has it.

        The logarithm of how much likelier what is seen is than in a scene where none of it is asked
        for: there what holds is as seldom as here its contrary.
        """
        if hypothesis.finished is not None:
            return 0.0
        return sum(self._gain(x, see(x.step)) for x in leaves(hypothesis.state))

    def _gain(self, leaf: Leaf[StepMonitor], seen: ActionObservation) -> float:
        fit = self.hmm.fit
        if not seen.observed or self._over(leaf):
            return 0.0
        if seen.contrary is not None and (seen.decisive or seen.holds is not Truth.TRUE):
            return math.log(fit(ActionStatus.CONTRARY, seen.contrary.confidence, 1.0))
        if seen.helps is not None:
            return -math.log(fit(ActionStatus.CONTRARY, seen.helps.confidence, 1.0))
        return 0.0 if leaf.payload.begun is None else math.log(fit(ActionStatus.NEITHER, 1.0, 1.0))

    def place(self, hypothesis: TaskHypothesis) -> HiddenState:
        """Where a hypothesis is by the model: its phases are read off what is kept of its steps."""
        if hypothesis.finished is not None:
            return HiddenState(END, ())
        return HiddenState(hypothesis.node, tuple(self._phase(x) for x in leaves(hypothesis.state)))

    def _phase(self, leaf: Leaf[StepMonitor]) -> int:
        monitor, whole = leaf.payload, self.hmm.count(leaf.step)
        if monitor.status in BAD:
            return whole + (1 if monitor.status is Status.FAILING else 2)
        if monitor.fulfilled:
            return whole
        return WAITING if monitor.begun is None else 1

    def _age(
        self, hypothesis: TaskHypothesis, see: Observe, now: float, dt: float
    ) -> TaskHypothesis:
        """The same hypothesis after `dt` seconds in which it stays where it is."""
        if hypothesis.finished is not None and now - hypothesis.finished > self.settings.regret_s:
            return hypothesis
        done = hypothesis.finished is not None
        new = [self._look(leaf, see(leaf.step), now, dt, done) for leaf in leaves(hypothesis.state)]
        fits = math.prod(self._fit(x, see(x.step), done, dt) for x in new)
        lost = any(x.payload.status in BAD for x in new)
        return replace(
            hypothesis,
            state=with_leaves(hypothesis.state, iter(new)),
            mass=hypothesis.mass * fits,
            best=hypothesis.best * fits,
            finished=None if lost else hypothesis.finished,
        )

    def _look(
        self, leaf: Leaf[StepMonitor], seen: ActionObservation, now: float, dt: float, done: bool
    ) -> Leaf[StepMonitor]:
        # A `within` no longer matters once the task is done.
        step = replace(leaf.step, deadlines=()) if done else leaf.step
        meaning = self.actions[step.action]
        monitor = update(leaf.payload, step, meaning, seen, now, dt, self.settings)
        return replace(leaf, payload=monitor)

    def _fit(
        self, leaf: Leaf[StepMonitor], seen: ActionObservation, done: bool, dt: float
    ) -> float:
        """How well `dt` seconds of what is seen fit a step; 1 at best."""
        if not seen.observed:
            return self.hmm.fit(ActionStatus.UNKNOWN, 1.0, dt)
        if seen.contrary is not None and (seen.decisive or seen.holds is not Truth.TRUE):
            return self.hmm.fit(ActionStatus.CONTRARY, seen.contrary.confidence, dt)
        if done or self._over(leaf) or (seen.helps is not None and leaf.payload.held):
            return 1.0
        if seen.helps is not None or leaf.payload.begun is None:
            return math.exp(-self.hmm.begin * dt)  # it has not begun to hold in all that time
        return self.hmm.fit(ActionStatus.NEITHER, 1.0, dt)

    def _over(self, leaf: Leaf[StepMonitor]) -> bool:
        return over(leaf.payload, leaf.step, self.actions[leaf.step.action])

    def _go_on(
        self, hypothesis: TaskHypothesis, see: Observe, now: float, dt: float
    ) -> Iterator[TaskHypothesis]:
        """A hypothesis and those that come out of it by leaving a step."""
        transitions = self.onward(hypothesis, now)
        hypothesis = replace(hypothesis, met=self._met(hypothesis, transitions, see, now))
        ends = [w for w in transitions if w.ends and self._may_end(w)]
        if ends and hypothesis.finished is None:
            hypothesis = replace(hypothesis, finished=now)
        open_to = [
            (w, self._spoken_for(hypothesis, w, see, now)) for w in transitions if not w.ends
        ]
        open_to = [(w, level) for w, level in open_to if level > 0]
        # Where the steps are over by themselves, nothing is left to stay for but the end.
        shares = sum(w.share for w, _ in open_to) or 1.0
        forced = not ends and any(level >= OVER and self._all_over(w) for w, level in open_to)
        gone = 0.0
        for transition, level in open_to:
            chance = (
                self._chance(hypothesis, transition, level, bool(ends), dt)
                * transition.share
                / shares
            )
            if forced:
                chance = transition.share / shares * self._skipped(transition)
            if chance > 0.0:
                gone += chance
                yield self._moved(hypothesis, transition, chance, see, now)
        if not forced:
            weighed = tuple((w.entered, level) for w, level in open_to)
            yield replace(hypothesis, weighed=weighed).times(max(0.0, 1.0 - gone))

    def _may_end(self, transition: Onward) -> bool:
        return all(x.payload.fulfilled and x.payload.status not in BAD for x in transition.left)

    def _all_over(self, transition: Onward) -> bool:
        return all(self._over(x) for x in transition.left)

    def _spoken_for(
        self, hypothesis: TaskHypothesis, transition: Onward, see: Observe, now: float
    ) -> int:
        """How strongly something speaks for a way on; 0 when nothing does."""
        finished = self._all_over(transition)
        if not finished and all(self._goes_on(s, transition.left) for s in transition.entered):
            return 0
        if transition.entered and self._seen(hypothesis, transition, see, now):
            return BEGUN
        if finished:
            return OVER
        return NEARER if all(self._comes(s, see(s), now) for s in transition.entered) else 0

    def _chance(
        self, hypothesis: TaskHypothesis, transition: Onward, level: int, ends: bool, dt: float
    ) -> float:
        """Probability that the course goes on now by a way that is spoken for."""
        seen_through = self._skipped(transition)
        if level <= dict(hypothesis.weighed).get(transition.entered, 0):
            # What was told already is told once; but what was seen to begin may begin later on.
            return seen_through * -math.expm1(-self.hmm.leave * dt) if level == BEGUN else 0.0
        if level == BEGUN:
            return seen_through * (1.0 - self.hmm.spurious)
        if level == OVER:
            return 0.5 if ends else 1.0
        return seen_through * self.hmm.unseen

    def _seen(
        self, hypothesis: TaskHypothesis, transition: Onward, see: Observe, now: float
    ) -> bool:
        """Whether all that a way enters has been seen to begin, and nothing says "not yet"."""
        if any(see(s).not_yet for s in transition.entered):
            return False
        return (
            now - dict(hypothesis.met).get(transition.entered, -math.inf) <= self.settings.contact_s
        )

    def _met(
        self, hypothesis: TaskHypothesis, transitions: list[Onward], see: Observe, now: float
    ) -> tuple[tuple[tuple[TaskStep, ...], float], ...]:
        """When the entry to each move was last seen, with what is seen now."""
        met = dict(hypothesis.met)
        for transition in transitions:
            conditions = (see(s).entry for s in transition.entered)
            if transition.entered and all(self._enters(condition, now) for condition in conditions):
                met[transition.entered] = now
        return tuple(met.items())

    def _enters(self, condition: Relation | None, now: float) -> bool:
        """Whether a sign of a step has lasted long enough."""
        return condition is not None and now - condition.since >= self.settings.enter_s - 1e-9

    def _comes(self, step: TaskStep, seen: ActionObservation, now: float) -> bool:
        """Whether a step is seen to come nearer; one whose course says when it begins only begins."""
        return step.condition("begins") is None and self._enters(seen.helps, now)

    def _goes_on(self, step: TaskStep, left: tuple[Leaf[StepMonitor], ...]) -> bool:
        """Whether a step asks for what is going on already: it can only begin once that ceased."""
        return any(step.same_as(x.step) and not x.payload.ceased for x in left)

    def _skipped(self, transition: Onward) -> float:
        """Probability that the steps that a way leaves are left as they stand."""
        return math.prod(self._passed_over(x) for x in transition.left)

    def _passed_over(self, leaf: Leaf[StepMonitor]) -> float:
        if leaf.payload.fulfilled:
            return 1.0
        lasts = self.actions[leaf.step.action].lasts
        missed = not lasts and not leaf.payload.held and leaf.payload.broken_since is not None
        return self.hmm.pass_over ** (2 if missed else 1)

    def _moved(
        self,
        hypothesis: TaskHypothesis,
        transition: Onward,
        chance: float,
        see: Observe,
        now: float,
    ) -> TaskHypothesis:
        opened = self._seen(hypothesis, transition, see, now)
        state, node = self._paths.taken(transition, hypothesis.state, entered(now))
        fresh = [
            self._look(_opened(x, opened), see(x.step), now, 0.0, False)
            if i in transition.fresh
            else x
            for i, x in enumerate(leaves(state))
        ]
        under_way = {x.step.stage for x in fresh}
        told = {p.stage: p for p in hypothesis.past}
        endings = sorted(
            (self._ending(x, now) for x in transition.left), key=lambda e: WORSE[e.status]
        )
        for ending in endings:
            failed = ending.status is Status.FAILED
            before = told.get(ending.stage)
            if before is not None and before.status is Status.FAILED:
                continue  # there is no way back from that
            if ending.stage not in under_way or failed:
                told[ending.stage] = ending
        now_at = with_leaves(state, iter(fresh))
        past = tuple(told.values())
        backpointer = extended(hypothesis.backpointer, tuple(x.step for x in transition.left), now)
        mass, best = hypothesis.mass * chance, hypothesis.best * chance
        return TaskHypothesis(now_at, node, mass, best, past, backpointer=backpointer, gone_on=True)

    def _ending(self, leaf: Leaf[StepMonitor], now: float) -> StageBelief:
        """How the stage of a step ends when it ends with this step."""
        status, why = outcome(leaf.step, self.actions[leaf.step.action], leaf.payload, now)
        return StageBelief(leaf.step.stage, status, now, leaf.payload.confidence, why)


def _opened(leaf: Leaf[StepMonitor], opened: bool) -> Leaf[StepMonitor]:
    return replace(leaf, payload=replace(leaf.payload, opened=True)) if opened else leaf


def confidence(hypotheses: tuple[TaskHypothesis, ...]) -> float:
    """How likely the hypothesis is that is told: its probability, given all that was seen."""
    return hypotheses[0].mass if hypotheses else 0.0
