"""The model of supervision: phases are derived from the observations, so that they can be explained.

Like `HiddenPhases` it is a model of the task filter, with the same states, `StageHmm` and backpointers. The
phase of a step is not hidden but determined by a monitor (`step_monitor.py`). So a hypothesis advances only
on evidence, not at a rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import islice

from visup.agent import Relation, Status
from visup.agent.model.fast_replace import replace
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.actions.rhythm import Rhythm
from visup.tasks.actions.vocabulary import FactEvaluator
from visup.tasks.automaton.automaton import END, Automaton
from visup.tasks.automaton.backpointers import behind
from visup.tasks.automaton.forward_recursion import merged
from visup.tasks.automaton.out_of_turn import later_steps
from visup.tasks.automaton.prognosis import Prognosis, begun_by
from visup.tasks.automaton.stage_hmm import SUPERVISION_HMM, StageHmm
from visup.tasks.automaton.states import TaskStep, leaves, with_leaves
from visup.tasks.automaton.task_filter import TaskFilter
from visup.tasks.automaton.transitions import HiddenState
from visup.tasks.grammar.nodes import StageCondition, Task
from visup.tasks.grammar.structure import pause_conditions
from visup.tasks.supervision.advance import Advance
from visup.tasks.supervision.hypotheses import ContactEntry, TaskHypotheses, TaskHypothesis
from visup.tasks.supervision.open_transitions import OpenTransitions
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.observe import TRENDS
from visup.tasks.verification.settings import TaskSettings
from visup.tasks.verification.step_model import Observe, StepModel
from visup.tasks.verification.step_monitor import BAD, Moment

LEAST = 1e-13  # hypotheses with less mass are dropped

Requirement = tuple[tuple[str, ...], tuple[str, ...]]
"""(actors, relations): the relations that are required between these actors."""


MAX_LATER = 40
"""Most later steps of a node, nearest first, that are watched for being done before their turn."""

CARRIES = ("moving_together", "coupled")
"""Relations of a carrier to the object that it carries."""


SupervisionFilter = TaskFilter[int, TaskHypothesis, Observe]
"""The task filter with the model of supervision."""


@dataclass(frozen=True)
class MonitoredPhases:
    """A task whose phases are derived from the observations; see `TaskModel`.

    Attributes:
        task: The task.
        actions: Meanings of its actions, with those of comparisons and zones (see `task_vocabulary`).
        settings: Time constants and thresholds.
        evaluators: Evaluators of facts that are not relations of the mind.
        rhythms: Periodic actions.
        hmm: The probabilities of the model.
    """

    task: Task
    actions: Mapping[str, ActionDefinition]
    settings: TaskSettings
    evaluators: Mapping[str, FactEvaluator] = field(default_factory=dict)
    rhythms: Mapping[str, Rhythm] = field(default_factory=dict)
    hmm: StageHmm = SUPERVISION_HMM

    @cached_property
    def filter(self) -> SupervisionFilter:
        """The task filter with this model."""
        return TaskFilter(self, self.settings.most_courses, LEAST)

    @cached_property
    def automaton(self) -> Automaton:
        """The states of the course, computed on demand."""
        return Automaton(self.task)

    @cached_property
    def prognosis(self) -> Prognosis:
        """The model's predictions for the rest of the task."""
        return Prognosis(self.automaton, self.hmm)

    @cached_property
    def steps(self) -> StepModel:
        """The interpretation of the monitors of steps."""
        return StepModel(self.actions, self.settings, self.hmm)

    @cached_property
    def pauses(self) -> tuple[StageCondition, ...]:
        """All pause conditions, each once."""
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
        """The steps with which the task may begin."""
        return tuple(self._open.first_steps())

    @cached_property
    def moved_later(self) -> frozenset[str]:
        """The actors that later stages require to approach or leave something, and no first step names."""
        first = {a for step in self.first_steps for a in step.actors}
        steps = later_steps(self.automaton, [node for node, _, _ in self.begin(0.0)])
        return frozenset(s.actors[0] for s in steps if s.action in TRENDS) - first

    @cached_property
    def _requirements(self) -> dict[int, tuple[Requirement, ...]]:
        return {}

    def requirements(self, node: int) -> tuple[Requirement, ...]:
        """Requirements at a node of the automaton: actors, and relations between them.

        For each active step the relations by which it holds and that it expects; for each possible next one
        those by which it begins; and what these imply for carriers (`brought_along`).
        """
        if node not in self._requirements:
            asked = tuple(self._required(node))
            self._requirements[node] = (*asked, *brought_along(asked))
        return self._requirements[node]

    @cached_property
    def _later(self) -> dict[int, tuple[TaskStep, ...]]:
        return {}

    def later(self, node: int) -> tuple[TaskStep, ...]:
        """The next steps after a node that would be out of turn if they were done now, at most `MAX_LATER`.

        These end once they have held, and take work: that two objects are apart, say, is true before anything
        is done. Steps that may have been satisfied before their turn are left out.
        """
        if node not in self._later:
            found = (s for s in later_steps(self.automaton, (node,)) if self._is_work(s))
            self._later[node] = tuple(islice(found, MAX_LATER))
        return self._later[node]

    def _is_work(self, step: TaskStep) -> bool:
        meaning = self.actions[step.action]
        other = meaning.lasts or meaning.measures or meaning.undoes
        return not (other or step.already or step.has_stage_conditions)

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
        """See `TaskModel`; of the paths to one state only the best is followed."""
        for node, best_path in merged(self.paths(posterior, evidence, now, dt)).items():
            yield node, best_path.value(), best_path.mass, best_path.best

    def paths(
        self, posterior: TaskHypotheses, evidence: Observe, now: float, dt: float
    ) -> Iterator[tuple[int, Callable[[], TaskHypothesis], float, float]]:
        """All paths to successors, as `extended` gives them; the hypotheses are not made yet."""
        advance = Advance(self.steps, evidence, now, dt)
        seen = tuple(self._seen_anew(posterior, evidence, now))
        for weighted in posterior.hypotheses.values():
            hypothesis, fit = self._aged(weighted.value, evidence, now, dt)
            fit *= self._false_alarms(weighted.value, seen)
            mass, best = weighted.mass * fit, weighted.best * fit
            contact = hypothesis.contact_entry
            if contact and self._taken_back(hypothesis, contact, evidence, now):
                yield contact.before.node, partial(replace, contact.before), mass, best
                continue
            open_to = self._open.of(hypothesis.state, hypothesis.node, now)
            for node, made, chance in advance.outcomes(hypothesis, open_to):
                yield node, made, mass * chance, best * chance

    def _taken_back(
        self, hypothesis: TaskHypothesis, contact: ContactEntry, observe: Observe, now: float
    ) -> bool:
        """Whether the two in contact have only passed each other, or part as another course says.

        A contact that has lasted for as long as its step requires is not taken back.
        """
        seen = observe(contact.step)
        if seen.passed_since is not None:
            return seen.passed_since - contact.at <= self.settings.contact_s
        leaf = next((x for x in leaves(hypothesis.state) if x.step == contact.step), None)
        if leaf is None or leaf.payload.fulfilled or seen.contrary is None:
            return False
        before = contact.before
        courses = (t.entered for t in self._open.of(before.state, before.node, now))
        return any(steps and all(_parts(observe(s), seen) for s in steps) for steps in courses)

    def _seen_anew(
        self, posterior: TaskHypotheses, observe: Observe, now: float
    ) -> Iterator[tuple[TaskStep, Relation]]:
        """Steps awaited by some hypothesis that have now held for a whole look (`look_s`).

        By then any hypothesis that can advance to them has done so. None for a single hypothesis, which has
        no alternative to be weighed against.
        """
        if len(posterior.hypotheses) == 1:
            return
        look = self.hmm.look_s - 1e-9  # times of frames are rounded
        nodes = dict.fromkeys(w.value.node for w in posterior.hypotheses.values())
        for step in dict.fromkeys(s for node in nodes for s in self._due(node)):
            seen = observe(step)
            held_by = seen.held_by
            if held_by is None or seen.elapsed(step, held_by.since, now) < look:
                continue
            if seen.elapsed(step, held_by.since, posterior.time) < look:
                yield step, held_by

    def _due(self, node: int) -> tuple[TaskStep, ...]:
        """The active steps at a node, and the possible next ones."""
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
        """The likelihood of a hypothesis for the observations that it must regard as false alarms."""
        alarms = (r for step, r in seen if not self._explained(hypothesis, step, r))
        return math.prod(self.hmm.false_alarm(r.confidence) for r in alarms)

    def _explained(self, hypothesis: TaskHypothesis, step: TaskStep, relation: Relation) -> bool:
        """Whether an observed step is active, completed or helpful under a hypothesis."""
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
        """See `TaskModel`; a course with a finally failed stage has no next stages."""
        return (
            {} if hypothesis.failed else self.prognosis.next_stages(self.hidden_state(hypothesis))
        )

    def success(self, key: int, hypothesis: TaskHypothesis) -> float:
        """See `TaskModel`; a course with a finally failed stage cannot succeed."""
        return 0.0 if hypothesis.failed else self.prognosis.success(self.hidden_state(hypothesis))

    def hidden_state(self, hypothesis: TaskHypothesis) -> HiddenState:
        """The state of a hypothesis in terms of `StageHmm`, with the phases of its monitors."""
        if hypothesis.finished is not None:
            return HiddenState(END, ())
        return HiddenState(
            hypothesis.node, tuple(self.steps.phase(x) for x in leaves(hypothesis.state))
        )

    def gain(self, hypothesis: TaskHypothesis, observe: Observe) -> float:
        """Evidence per second that a task is in progress, according to a hypothesis.

        The log-likelihood ratio of the observations to a scene without the task, in which a required action
        is as rare as its contrary is here.
        """
        if hypothesis.finished is not None:
            return 0.0
        return sum(self.steps.gain(x, observe(x.step)) for x in leaves(hypothesis.state))

    def _aged(
        self, hypothesis: TaskHypothesis, observe: Observe, now: float, dt: float
    ) -> tuple[TaskHypothesis, float]:
        """A hypothesis after `dt` seconds in the same state, and its likelihood."""
        finished = hypothesis.finished
        if finished is not None and self._settled(hypothesis, finished, observe, now):
            return hypothesis, 1.0
        done, moment = finished is not None, Moment(now, dt)
        looked_at = (
            self.steps.observed(x, observe(x.step), moment, done) for x in leaves(hypothesis.state)
        )
        state = self.steps.together(with_leaves(hypothesis.state, looked_at), observe)
        new = leaves(state)
        fit = self.steps.joint_fit(state, observe, done, dt)
        lost = any(x.payload.status in BAD for x in new)
        return replace(hypothesis, state=state, finished=None if lost else finished), fit

    def _settled(
        self, hypothesis: TaskHypothesis, finished: float, observe: Observe, now: float
    ) -> bool:
        """Whether a task has been completed for long enough to make its success final."""
        steps = [x.step for x in leaves(hypothesis.state)]
        worked = min(observe(s).elapsed(s, finished, now) for s in steps)
        return worked > self.settings.regret_s


def _parts(step: ActionObservation, met: ActionObservation) -> bool:
    """Whether a step has begun by what contradicts a contact."""
    return step.entry is not None and step.entry == met.contrary


def brought_along(asked: Sequence[Requirement]) -> Iterator[Requirement]:
    """The requirements implied for carriers: a carrier approaches the place to which it brings an object.

    Args:
        asked: The requirements of some steps.
    """
    pairs = [(actors, names) for actors, names in asked if len(actors) == 2]
    carriers = [actors for actors, names in pairs if not set(CARRIES).isdisjoint(names)]
    for (carried, place), names in pairs:
        if "converging" in names:
            for carrier in (a for pair in carriers if carried in pair for a in pair):
                if carrier not in (carried, place):
                    yield (carrier, place), ("converging",)
