"""The model of supervision: phases are read off what was seen, so that they can be accounted for.

It is a model of the task filter as `HiddenPhases` is, with the same states, the same `StageHmm` and
the same backpointers. The phase of a step is not hidden: a monitor reads it off (`step_monitor.py`).
So a hypothesis goes on only when something seen speaks for it, not at a rate.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from visup.agent import Relation, Status
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.rhythm import Rhythm
from visup.tasks.actions.vocabulary import FactEvaluator
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import behind
from visup.tasks.automaton.prognosis import Prognosis, begun_by
from visup.tasks.automaton.stage_hmm import SUPERVISION_HMM, StageHmm
from visup.tasks.automaton.states import TaskStep, leaves, with_leaves
from visup.tasks.automaton.task_filter import TaskFilter
from visup.tasks.automaton.transitions import HiddenState
from visup.tasks.grammar.nodes import StageCondition, Task
from visup.tasks.grammar.structure import pause_conditions
from visup.tasks.supervision.advance import Advance, Observe
from visup.tasks.supervision.hypotheses import TaskHypotheses, TaskHypothesis
from visup.tasks.supervision.open_transitions import OpenTransitions
from visup.tasks.verification.settings import TaskSettings
from visup.tasks.verification.step_model import StepModel
from visup.tasks.verification.step_monitor import BAD, Moment

LEAST = 1e-13  # a hypothesis with less of the mass is given up

Requirement = tuple[tuple[str, ...], tuple[str, ...]]
"""Actors, and relations between them that are asked for."""


SupervisionFilter = TaskFilter[int, TaskHypothesis, Observe]
"""The task filter as it supervises."""


@dataclass(frozen=True)
class MonitoredPhases:
    """A task whose phases are read off what is seen; see `TaskModel`.

    Attributes:
        task: The task.
        actions: Meanings of its actions, with those of comparisons and zones (see `task_vocabulary`).
        settings: Patience.
        looks: Whether what is no plain relation of the mind holds.
        rhythms: What is to happen again and again.
        hmm: The probabilities of the model.
    """

    task: Task
    actions: Mapping[str, ActionDefinition]
    settings: TaskSettings
    looks: Mapping[str, FactEvaluator] = field(default_factory=dict)
    rhythms: Mapping[str, Rhythm] = field(default_factory=dict)
    hmm: StageHmm = SUPERVISION_HMM

    @cached_property
    def filter(self) -> SupervisionFilter:
        """The task filter with this model."""
        return TaskFilter(self, self.settings.most_courses, LEAST)

    @cached_property
    def automaton(self) -> Automaton:
        """The states of the course, worked out as they are come to."""
        return Automaton(self.task)

    @cached_property
    def prognosis(self) -> Prognosis:
        """What the model expects of the rest of the task."""
        return Prognosis(self.automaton, self.hmm)

    @cached_property
    def steps(self) -> StepModel:
        """What is read off the monitors of steps."""
        return StepModel(self.actions, self.settings, self.hmm)

    @cached_property
    def pauses(self) -> tuple[StageCondition, ...]:
        """The conditions that pause some of it, each once."""
        return tuple(dict.fromkeys(pause_conditions(self.task)))

    @cached_property
    def spare(self) -> Mapping[str, str]:
        """The actors that are not waited for, since each is one of many, with their common name."""
        return {a.name: a.spare for a in self.task.actors if a.spare}

    @cached_property
    def _open(self) -> OpenTransitions:
        return OpenTransitions(self.task, self.automaton)

    @cached_property
    def first_steps(self) -> tuple[TaskStep, ...]:
        """The steps with which the task may begin, whenever that is."""
        return tuple(self._open.first_steps())

    @cached_property
    def _requirements(self) -> dict[int, tuple[Requirement, ...]]:
        return {}

    def requirements(self, node: int) -> tuple[Requirement, ...]:
        """Requirements at a node of the automaton: actors, and relations between them.

        Of each step under way what it holds and expects, of each that may come next its beginning.
        """
        if node not in self._requirements:
            self._requirements[node] = tuple(self._required(node))
        return self._requirements[node]

    def _required(self, node: int) -> Iterator[Requirement]:
        for step in self.automaton.steps(node):
            meaning = self.actions[step.action]
            yield step.actors, (meaning.name, *meaning.holds, *meaning.expects)
        for transition in self.automaton.transitions(node):
            for step in begun_by(self.automaton, transition):
                begins = self.actions[step.action].begins
                yield step.actors, tuple("touching" if n == "in_contact" else n for n in begins)

    def begin(self, now: float) -> Iterator[tuple[int, TaskHypothesis, float]]:
        """See `TaskModel`."""
        found = self._open.begin(now)
        for state, node in found:
            yield node, TaskHypothesis(state, node), 1.0 / len(found)

    def extended(
        self, posterior: TaskHypotheses, evidence: Observe, now: float, dt: float
    ) -> Iterator[tuple[int, TaskHypothesis, float, float]]:
        """See `TaskModel`."""
        seen = tuple(self._seen_anew(posterior, evidence, now))
        for weighted in posterior.hypotheses.values():
            hypothesis, fit = self._aged(weighted.value, evidence, now, dt)
            fit *= self._false_alarms(weighted.value, seen)
            mass, best = weighted.mass * fit, weighted.best * fit
            open_to = self._open.of(hypothesis.state, hypothesis.node, now)
            for new, chance in Advance(self.steps, evidence, now, dt).outcomes(hypothesis, open_to):
                yield new.node, new, mass * chance, best * chance

    def _seen_anew(
        self, posterior: TaskHypotheses, observe: Observe, now: float
    ) -> Iterator[tuple[TaskStep, Relation]]:
        """Steps that some hypothesis waits for, and that by now have held for a whole look.

        By then a hypothesis that may go on to them has; with one alone there is none to compare it to.
        """
        if len(posterior.hypotheses) == 1:
            return
        look = self.hmm.look_s
        nodes = dict.fromkeys(w.value.node for w in posterior.hypotheses.values())
        for step in dict.fromkeys(s for node in nodes for s in self._due(node)):
            seen = observe(step)
            held_by = seen.held_by
            if held_by is None or seen.elapsed(step, held_by.since, now) < look:
                continue
            if seen.elapsed(step, held_by.since, posterior.time) < look:
                yield step, held_by

    def _due(self, node: int) -> tuple[TaskStep, ...]:
        """The steps under way at a node, and those that may come next."""
        if node not in self._known_due:
            later = (begun_by(self.automaton, t) for t in self.automaton.transitions(node))
            steps = (*self.automaton.steps(node), *(s for steps in later for s in steps))
            self._known_due[node] = tuple(dict.fromkeys(steps))
        return self._known_due[node]

    @cached_property
    def _known_due(self) -> dict[int, tuple[TaskStep, ...]]:
        return {}

    def _false_alarms(
        self, hypothesis: TaskHypothesis, seen: Sequence[tuple[TaskStep, Relation]]
    ) -> float:
        """How likely a hypothesis is for what it must take for false alarms."""
        alarms = (r for step, r in seen if not self._explained(hypothesis, step, r))
        return math.prod(self.hmm.false_alarm(r.confidence) for r in alarms)

    def _explained(self, hypothesis: TaskHypothesis, step: TaskStep, relation: Relation) -> bool:
        """Whether a step that is seen is under way by a hypothesis, lies behind it, or helps it."""
        for leaf in leaves(hypothesis.state):
            helps = relation.name in self.actions[leaf.step.action].helps
            if step.same_as(leaf.step) or (helps and step.actors == leaf.step.actors):
                return True
        return any(step.same_as(b.step) for b in behind(hypothesis.backpointer))

    def stage_statuses(
        self, key: int, hypothesis: TaskHypothesis
    ) -> Collection[tuple[str, Status]]:
        """See `TaskModel`."""
        if hypothesis.finished is not None:
            return {("", Status.DONE)}
        return {(x.step.stage, x.payload.status) for x in leaves(hypothesis.state)}

    def next_stages(self, key: int, hypothesis: TaskHypothesis) -> Mapping[str, float]:
        """See `TaskModel`; a course of which a stage has failed for good goes nowhere."""
        return (
            {} if hypothesis.failed else self.prognosis.next_stages(self.hidden_state(hypothesis))
        )

    def success(self, key: int, hypothesis: TaskHypothesis) -> float:
        """See `TaskModel`; a course of which a stage has failed for good has no success."""
        return 0.0 if hypothesis.failed else self.prognosis.success(self.hidden_state(hypothesis))

    def hidden_state(self, hypothesis: TaskHypothesis) -> HiddenState:
        """Where a hypothesis is by `StageHmm`: its phases are read off its monitors."""
        if hypothesis.finished is not None:
            return HiddenState(END, ())
        return HiddenState(
            hypothesis.node, tuple(self.steps.phase(x) for x in leaves(hypothesis.state))
        )

    def gain(self, hypothesis: TaskHypothesis, observe: Observe) -> float:
        """Evidence per second that a task is in progress, according to a hypothesis.

        The logarithm of how much likelier what is seen is than in a scene where none of it is asked
        for: there what holds is as seldom as here its contrary.
        """
        if hypothesis.finished is not None:
            return 0.0
        return sum(self.steps.gain(x, observe(x.step)) for x in leaves(hypothesis.state))

    def _aged(
        self, hypothesis: TaskHypothesis, observe: Observe, now: float, dt: float
    ) -> tuple[TaskHypothesis, float]:
        """A hypothesis after `dt` seconds in which it stays where it is, and how well that fits."""
        finished = hypothesis.finished
        if finished is not None and self._settled(hypothesis, finished, observe, now):
            return hypothesis, 1.0
        done, moment = finished is not None, Moment(now, dt)
        new = [
            self.steps.looked_at(x, observe(x.step), moment, done) for x in leaves(hypothesis.state)
        ]
        fit = math.prod(self.steps.fit(x, observe(x.step), done, dt) for x in new)
        lost = any(x.payload.status in BAD for x in new)
        state = with_leaves(hypothesis.state, iter(new))
        return replace(hypothesis, state=state, finished=None if lost else finished), fit

    def _settled(
        self, hypothesis: TaskHypothesis, finished: float, observe: Observe, now: float
    ) -> bool:
        """Whether a task has been done for so long that its success is final."""
        steps = [x.step for x in leaves(hypothesis.state)]
        worked = min(observe(s).elapsed(s, finished, now) for s in steps)
        return worked > self.settings.regret_s
