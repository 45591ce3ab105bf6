"""From readings to belief: stages, what is under way, what is expected, the verdict."""

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
from visup.tasks.automaton.derivatives import Leaf, Step, leaves
from visup.tasks.grammar.conditions import Condition
from visup.tasks.grammar.nodes import Hold
from visup.tasks.grammar.structure import stage_names
from visup.tasks.supervision.hypotheses import Follower, Reading, confidence
from visup.tasks.supervision.inference import Activity
from visup.tasks.supervision.sentences import evidence, outcome
from visup.tasks.verification.observe import NEVER, Relations, Sighting, observe
from visup.tasks.verification.stage_condition import Conditions
from visup.tasks.verification.verify import BAD, Watch

NEAR = 0.01  # readings that are so likely against the best have a say in what is expected

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


class Scene:
    """One task at one moment: who plays its actors, and what is seen of its actions.

    Args:
        mind: What is believed.
        bindings: Who plays which actor.
        follower: The task with the meanings of its actions.
        before: Since when what is no plain relation of the mind has been true, by key.
    """

    def __init__(
        self,
        mind: Mind,
        bindings: tuple[Binding, ...],
        follower: Follower,
        before: Mapping[str, float] = NEVER,
    ) -> None:
        self.mind = mind
        self.bindings = bindings
        self._actions = follower.actions
        self._objects = {b.actor: b.object_id for b in bindings}
        self._relations = Relations(mind, follower.looks, before)
        self._conditions = Conditions(follower.task, self._holds, self._relations)
        self._seen: dict[tuple[str, tuple[str, ...]], Sighting] = {}
        self._judged: dict[Step, Sighting] = {}

    def see(self, step: Step) -> Sighting:
        """What is seen now of a step."""
        if not step.signs:
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

    def _look(self, action: str, actors: tuple[str, ...]) -> Sighting:
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


def believe(
    follower: Follower, scene: Scene, readings: tuple[Reading, ...], interrupted: str
) -> TaskBelief:
    """What is believed of a task.

    Args:
        follower: The task with its settings.
        scene: What is seen now.
        readings: Likeliest first; empty while the task has not begun.
        interrupted: Why it is interrupted, or empty.

    Returns:
        The belief; `unexplained` is left to the caller.
    """
    name, now = follower.task.name, scene.mind.time
    if not readings:
        verdict = Verdict.INTERRUPTED if interrupted else Verdict.UNKNOWN
        return TaskBelief(
            name,
            verdict,
            tuple(StageBelief(s, Status.PENDING, 0.0) for s in stage_names(follower.task)),
            bindings=scene.bindings,
            expected=_expected(follower, scene, follower.start(now)),
            evidence=interrupted or _missing(follower, scene),
        )
    best, sure = readings[0], confidence(readings)
    stages = _stages(follower, best, now, sure)
    verdict, why = _verdict(best, stages, interrupted)
    current = None if best.finished is not None else _current(follower, best)
    near = tuple(r for r in readings if r.mass >= NEAR * best.mass)
    return TaskBelief(
        name,
        verdict,
        stages,
        current,
        scene.bindings,
        _expected(follower, scene, near),
        confidence=sure,
        evidence=why,
        prospects=_prospects(follower, near),
        success=0.0 if verdict in LOST else follower.success(near),
    )


def _prospects(follower: Follower, readings: tuple[Reading, ...]) -> tuple[Prospect, ...]:
    """The stages that may begin next; those that are hardly possible are left out."""
    found = follower.next_stages(readings).items()
    likely = sorted((s for s in found if s[1] >= NEAR), key=lambda s: -s[1])
    return tuple(Prospect(stage, min(1.0, chance)) for stage, chance in likely)


def hushed(belief: TaskBelief, activity: Activity) -> TaskBelief:
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
    follower: Follower, reading: Reading, now: float, sure: float
) -> tuple[StageBelief, ...]:
    told = {p.stage: p for p in reading.past}
    under_way: dict[str, list[Leaf[Watch]]] = {}
    for leaf in leaves(reading.state):
        under_way.setdefault(leaf.step.stage, []).append(leaf)
    for stage, steps in under_way.items():
        if stage in told and told[stage].status is Status.FAILED:
            continue  # one of its steps has failed for good
        told[stage] = _stage(follower, stage, steps, reading.finished, now, sure)
    pending = {s: StageBelief(s, Status.PENDING, 0.0) for s in stage_names(follower.task)}
    return tuple(told.get(s, belief) for s, belief in pending.items())


def _stage(
    follower: Follower,
    stage: str,
    steps: list[Leaf[Watch]],
    finished: float | None,
    now: float,
    sure: float,
) -> StageBelief:
    leaf = min(steps, key=lambda x: WORST_FIRST.index(x.watch.status))
    watch, meaning = leaf.watch, follower.actions[leaf.step.action]
    if finished is not None:
        _, why = outcome(leaf.step, meaning, watch, finished)
        return StageBelief(stage, Status.DONE, finished, sure * watch.confidence, why)
    why = evidence(leaf.step, meaning, watch, now, follower.actions)
    return StageBelief(stage, watch.status, watch.since, sure * watch.confidence, why)


def _current(follower: Follower, reading: Reading) -> str:
    """The stage under way; of several at the same time the one that stands worst."""
    steps = leaves(reading.state)
    return min(steps, key=lambda x: WORST_FIRST.index(x.watch.status)).step.stage


def _verdict(
    reading: Reading, stages: tuple[StageBelief, ...], interrupted: str
) -> tuple[Verdict, str]:
    if interrupted:
        return Verdict.INTERRUPTED, interrupted
    failed = next((s for s in stages if s.status is Status.FAILED), None)
    if failed is not None:
        return Verdict.FAILED, failed.evidence
    if reading.finished is not None:
        return Verdict.SUCCEEDED, f"all stages were done at {reading.finished:.1f} s"
    bad = next((s for s in stages if s.status in BAD), None)
    if reading.begun or bad is not None:
        told = bad or next((s for s in stages if s.stage == reading_stage(reading)), None)
        return Verdict.IN_PROGRESS, told.evidence if told else ""
    return Verdict.UNKNOWN, "nothing of the task has been seen yet"


def reading_stage(reading: Reading) -> str:
    """The first stage under way in a reading."""
    return leaves(reading.state)[0].step.stage


def _missing(follower: Follower, scene: Scene) -> str:
    unbound = (b.actor for b in scene.bindings if b.object_id is None)
    missing = [a for a in unbound if not follower.task.actor(a).optional]
    return f"not found yet: {', '.join(missing)}" if missing else "nothing of it has been seen yet"


def _expected(
    follower: Follower, scene: Scene, readings: tuple[Reading, ...]
) -> tuple[Expectation, ...]:
    """What is under way asks for, and the entry to what may come next; each told once."""
    asked = dict.fromkeys(a for r in readings for a in follower.asked_for(r.node))
    wanted = (
        Expectation(name, scene.objects(actors))
        for actors, names in asked
        if scene.found(actors)
        for name in names
    )
    return tuple(dict.fromkeys(wanted))
