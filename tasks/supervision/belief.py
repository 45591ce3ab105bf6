"""From hypotheses to belief: stages, what is under way, what is expected, the verdict."""

from __future__ import annotations

from collections.abc import Mapping

from visup.agent import (
    Binding,
    Expectation,
    Mind,
    Prospect,
    StageBelief,
    Status,
    TaskBelief,
    Truth,
    Verdict,
)
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.derivatives import Leaf, TaskStep, leaves
from visup.tasks.grammar.conditions import Condition
from visup.tasks.grammar.nodes import Hold
from visup.tasks.grammar.structure import stage_names
from visup.tasks.supervision.hypotheses import HypothesisTracker, TaskHypothesis, confidence
from visup.tasks.supervision.sentences import evidence, outcome
from visup.tasks.supervision.task_inference import TaskActivity
from visup.tasks.verification.observe import NEVER, ActionObservation, RelationLookup, observe
from visup.tasks.verification.stage_conditions import ConditionEvaluator
from visup.tasks.verification.step_monitor import BAD, StepMonitor

NEAR = 0.01  # hypotheses that are so likely against the best have a say in what is expected

LOST = (Verdict.FAILED, Verdict.INTERRUPTED)  # there is no way back from these

# Of several steps of one stage the first of these speaks for the stage.
WORST_FIRST = (
    Status.FAILED,
    Status.FAILING,
    Status.UNKNOWN,
    Status.STALLED,
    Status.ACTIVE,
    Status.PROGRESSING,
)


class TaskSnapshot:
    """One task at one moment: who plays its actors, and what is seen of its actions.

    Args:
        mind: What is believed.
        bindings: Who plays which actor.
        tracker: The task with the meanings of its actions.
        before: Since when what is no plain relation of the mind has been true, by key.
    """

    def __init__(
        self,
        mind: Mind,
        bindings: tuple[Binding, ...],
        tracker: HypothesisTracker,
        before: Mapping[str, float] = NEVER,
    ) -> None:
        self.mind = mind
        self.bindings = bindings
        self._actions = tracker.actions
        self._objects = {b.actor: b.object_id for b in bindings}
        self._relations = RelationLookup(mind, tracker.looks, before)
        self._conditions = ConditionEvaluator(tracker.task, self._holds, self._relations)
        self._seen: dict[tuple[str, tuple[str, ...]], ActionObservation] = {}
        self._judged: dict[TaskStep, ActionObservation] = {}

    def see(self, step: TaskStep) -> ActionObservation:
        """What is seen now of a step."""
        if not step.conditions:
            return self._look(step.action, step.actors)
        if step not in self._judged:
            seen = self._look(step.action, step.actors)
            self._judged[step] = self._conditions.apply(step, seen)
        return self._judged[step]

    def holds(self, condition: Condition, lasting: Hold | None) -> Truth:
        """Whether a condition holds, and has for as long as it must."""
        return self._conditions.relation(condition, lasting).truth

    @property
    def since(self) -> tuple[tuple[str, float], ...]:
        """Since when what is no plain relation of the mind has been true, for the next step."""
        return tuple(self._relations.after.items())

    def _look(self, action: str, actors: tuple[str, ...]) -> ActionObservation:
        key = (action, actors)
        if key not in self._seen:
            objects = tuple(self._objects.get(a) for a in actors)
            self._seen[key] = observe(self._actions[action], objects, self._relations)
        return self._seen[key]

    def _holds(self, action: str, actors: tuple[str, ...]) -> Truth:
        return self._look(action, actors).holds

    def found(self, actors: tuple[str, ...]) -> bool:
        """Whether each of some actors is played by an object."""
        return all(self._objects.get(a) is not None for a in actors)

    def objects(self, actors: tuple[str, ...]) -> tuple[int, ...]:
        """Ids of the objects that play some actors; those not found are left out."""
        ids = (self._objects.get(a) for a in actors)
        return tuple(i for i in ids if i is not None)


def task_belief(
    tracker: HypothesisTracker,
    scene: TaskSnapshot,
    hypotheses: tuple[TaskHypothesis, ...],
    interrupted: str,
) -> TaskBelief:
    """What is believed of a task.

    Args:
        tracker: The task with its settings.
        scene: What is seen now.
        hypotheses: Likeliest first; empty while the task has not begun.
        interrupted: Why it is interrupted, or empty.

    Returns:
        The belief; `unexplained` is left to the caller.
    """
    name, now = tracker.task.name, scene.mind.time
    if not hypotheses:
        verdict = Verdict.INTERRUPTED if interrupted else Verdict.UNKNOWN
        return TaskBelief(
            name,
            verdict,
            tuple(StageBelief(s, Status.PENDING, 0.0) for s in stage_names(tracker.task)),
            bindings=scene.bindings,
            expected=_expected(tracker, scene, tracker.start(now)),
            evidence=interrupted or _missing(tracker, scene),
        )
    best, sure = hypotheses[0], confidence(hypotheses)
    stages = _stages(tracker, best, now, sure)
    verdict, why = _verdict(best, stages, interrupted)
    current = None if best.finished is not None else _current(tracker, best)
    near = tuple(r for r in hypotheses if r.mass >= NEAR * best.mass)
    return TaskBelief(
        name,
        verdict,
        stages,
        current,
        scene.bindings,
        _expected(tracker, scene, near),
        confidence=sure,
        evidence=why,
        prospects=_prospects(tracker, near),
        success=0.0 if verdict in LOST else tracker.success(near),
    )


def _prospects(
    tracker: HypothesisTracker, hypotheses: tuple[TaskHypothesis, ...]
) -> tuple[Prospect, ...]:
    """The stages that may begin next; those that are hardly possible are left out."""
    found = tracker.next_stages(hypotheses).items()
    likely = sorted((s for s in found if s[1] >= NEAR), key=lambda s: -s[1])
    return tuple(Prospect(stage, min(1.0, chance)) for stage, chance in likely)


def suppressed(belief: TaskBelief, activity: TaskActivity) -> TaskBelief:
    """What is believed of a task that is probably not going on.

    Who could play its actors is still looked at, and while it is not excluded, what it asks for is
    still expected.
    """
    return replace(
        belief,
        verdict=Verdict.UNKNOWN,
        stages=tuple(StageBelief(s.stage, Status.PENDING, 0.0) for s in belief.stages),
        current=None,
        expected=() if activity.excluded else belief.expected,
        prospects=(),
        success=None,
        evidence=f"it is probably not going on ({activity.chance:.0%})".replace("%", " %"),
    )


def _stages(
    tracker: HypothesisTracker, hypothesis: TaskHypothesis, now: float, sure: float
) -> tuple[StageBelief, ...]:
    told = {p.stage: p for p in hypothesis.past}
    under_way: dict[str, list[Leaf[StepMonitor]]] = {}
    for leaf in leaves(hypothesis.state):
        under_way.setdefault(leaf.step.stage, []).append(leaf)
    for stage, steps in under_way.items():
        if stage in told and told[stage].status is Status.FAILED:
            continue  # one of its steps has failed for good
        told[stage] = _stage(tracker, stage, steps, hypothesis.finished, now, sure)
    pending = {s: StageBelief(s, Status.PENDING, 0.0) for s in stage_names(tracker.task)}
    return tuple(told.get(s, belief) for s, belief in pending.items())


def _stage(
    tracker: HypothesisTracker,
    stage: str,
    steps: list[Leaf[StepMonitor]],
    finished: float | None,
    now: float,
    sure: float,
) -> StageBelief:
    leaf = min(steps, key=lambda x: WORST_FIRST.index(x.payload.status))
    monitor, meaning = leaf.payload, tracker.actions[leaf.step.action]
    if finished is not None:
        _, why = outcome(leaf.step, meaning, monitor, finished)
        return StageBelief(stage, Status.DONE, finished, sure * monitor.confidence, why)
    why = evidence(leaf.step, meaning, monitor, now, tracker.actions)
    return StageBelief(stage, monitor.status, monitor.since, sure * monitor.confidence, why)


def _current(tracker: HypothesisTracker, hypothesis: TaskHypothesis) -> str:
    """The stage under way; of several at the same time the one that stands worst."""
    steps = leaves(hypothesis.state)
    return min(steps, key=lambda x: WORST_FIRST.index(x.payload.status)).step.stage


def _verdict(
    hypothesis: TaskHypothesis, stages: tuple[StageBelief, ...], interrupted: str
) -> tuple[Verdict, str]:
    if interrupted:
        return Verdict.INTERRUPTED, interrupted
    failed = next((s for s in stages if s.status is Status.FAILED), None)
    if failed is not None:
        return Verdict.FAILED, failed.evidence
    if hypothesis.finished is not None:
        return Verdict.SUCCEEDED, f"all stages were done at {hypothesis.finished:.1f} s"
    bad = next((s for s in stages if s.status in BAD), None)
    if hypothesis.begun or bad is not None:
        told = bad or next((s for s in stages if s.stage == current_stage(hypothesis)), None)
        return Verdict.IN_PROGRESS, told.evidence if told else ""
    return Verdict.UNKNOWN, "nothing of the task has been seen yet"


def current_stage(hypothesis: TaskHypothesis) -> str:
    """The first stage under way in a hypothesis."""
    return leaves(hypothesis.state)[0].step.stage


def _missing(tracker: HypothesisTracker, scene: TaskSnapshot) -> str:
    unbound = (b.actor for b in scene.bindings if b.object_id is None)
    missing = [a for a in unbound if not tracker.task.actor(a).optional]
    return f"not found yet: {', '.join(missing)}" if missing else "nothing of it has been seen yet"


def _expected(
    tracker: HypothesisTracker, scene: TaskSnapshot, hypotheses: tuple[TaskHypothesis, ...]
) -> tuple[Expectation, ...]:
    """What is under way asks for, and the entry to what may come next; each told once."""
    asked = dict.fromkeys(a for r in hypotheses for a in tracker.asked_for(r.node))
    wanted = (
        Expectation(name, scene.objects(actors))
        for actors, names in asked
        if scene.found(actors)
        for name in names
    )
    return tuple(dict.fromkeys(wanted))
