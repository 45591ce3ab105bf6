"""Derives the belief about a task from its hypotheses: stages, expectations, verdict.

Probabilities are marginals: that of a status or verdict is the sum over all hypotheses with it. The wording
is that of the most likely of these.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from visup.agent import (
    Expectation,
    Prospect,
    StageBelief,
    Status,
    TaskBelief,
    Verdict,
)
from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.states import leaves
from visup.tasks.grammar.structure import stage_names
from visup.tasks.grammar.templates import called
from visup.tasks.supervision.hypotheses import (
    NEAR,
    NOT_BEGUN,
    WORST_FIRST,
    Progress,
    Standing,
    TaskHypotheses,
    TaskHypothesis,
    likely,
    standings,
)
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.sentences import evidence, in_retrospect, outcome, paused_by
from visup.tasks.supervision.snapshot import TaskSnapshot
from visup.tasks.supervision.task_inference import TaskActivity
from visup.tasks.verification.pauses import Pause
from visup.tasks.verification.step_monitor import BAD

DIGITS = 9  # probabilities that differ by less are equal
# Of two equally likely next stages neither is reported to have begun: a waiting stage is reported only if
# that is more likely than pending after rounding to this many digits.
WAITING_DIGITS = 2

LOST = (Verdict.FAILED, Verdict.INTERRUPTED)  # verdicts without prospects


def task_belief(
    model: MonitoredPhases,
    snapshot: TaskSnapshot,
    posterior: TaskHypotheses | None,
    interrupted: str,
) -> TaskBelief:
    """The belief about a task.

    Args:
        model: The task with its filter.
        snapshot: The present observation.
        posterior: The hypotheses; None while the task has not begun.
        interrupted: Why it is interrupted, or empty.

    Returns:
        The belief; `unexplained` is set by the caller.
    """
    name = model.task.name
    if posterior is None:
        return TaskBelief(
            name,
            Verdict.INTERRUPTED if interrupted else Verdict.UNKNOWN,
            pending_stages(model),
            bindings=snapshot.bindings,
            expected=_expected(model, snapshot, model.filter.start(snapshot.mind.time)),
            evidence=interrupted or _missing(model, snapshot),
        )
    stages = tuple(stage_beliefs(model, posterior, snapshot))
    verdict, probability, teller = _outcome(posterior)
    current = None if teller.finished is not None else _current(posterior)
    if current is not None and verdict is not Verdict.FAILED:
        probability = _under_way(posterior)[current]
    why = _why(verdict, teller, stages, current)
    near = likely(posterior)
    outcome = Verdict.INTERRUPTED if interrupted else verdict
    return TaskBelief(
        name,
        outcome,
        stages,
        current,
        snapshot.bindings,
        _expected(model, snapshot, near),
        confidence=probability,
        evidence=interrupted or why,
        prospects=() if outcome in LOST else _prospects(model, snapshot, near),
        success=0.0 if outcome in LOST else model.filter.success(near),
    )


def failed_belief(belief: TaskBelief, before: TaskBelief, why: str, now: float) -> TaskBelief:
    """The belief about a task that failed by a broken invariant, in which the active stage has failed.

    Args:
        belief: The belief from the hypotheses.
        before: The previous belief.
        why: The broken invariant.
        now: Current time, seconds.
    """
    if belief.verdict is Verdict.INTERRUPTED:
        return belief
    if before.verdict is Verdict.FAILED:
        # Failure is final, and nothing more is reported.
        stages, current = before.stages, before.current
    else:
        current = belief.current
        stages = tuple(
            replace(s, status=Status.FAILED, since=now, evidence=why) if s.stage == current else s
            for s in belief.stages
        )
    return replace(
        belief,
        verdict=Verdict.FAILED,
        stages=stages,
        current=current,
        evidence=why,
        prospects=(),
        success=0.0,
    )


def out_of_order_belief(belief: TaskBelief, before: TaskBelief, why: str, now: float) -> TaskBelief:
    """The belief about a task whose order is broken: its current stage, which should come first, is failing.

    The beliefs about its stages are frozen until the step done too soon has been undone.

    Args:
        belief: The belief from the hypotheses.
        before: The previous belief.
        why: How the order is broken.
        now: Current time, seconds.
    """
    if belief.verdict in (*LOST, Verdict.SUCCEEDED):
        return belief
    belief = replace(belief, verdict=Verdict.IN_PROGRESS, evidence=why)
    if before.evidence == why:
        return replace(belief, stages=before.stages, current=before.current)
    stages = tuple(
        replace(s, status=Status.FAILING, since=now, evidence=why, confidence=belief.confidence)
        if s.stage == belief.current and s.status not in BAD
        else s
        for s in belief.stages
    )
    return replace(belief, stages=stages)


def pending_stages(model: MonitoredPhases) -> tuple[StageBelief, ...]:
    """The stages of a task that has not begun."""
    return tuple(StageBelief(s, Status.PENDING, 0.0) for s in stage_names(model.task))


def suppressed(belief: TaskBelief, activity: TaskActivity) -> TaskBelief:
    """The belief about a task that is probably not in progress.

    Its bindings are kept up to date, and unless the task is excluded, its requirements are still expected.
    """
    return replace(
        belief,
        verdict=Verdict.UNKNOWN,
        stages=tuple(StageBelief(s.stage, Status.PENDING, 0.0) for s in belief.stages),
        current=None,
        expected=() if activity.excluded else belief.expected,
        prospects=(),
        success=None,
        evidence=f"it is probably not in progress ({activity.chance:.0%})".replace("%", " %"),
    )


def stage_marginals(posterior: TaskHypotheses) -> dict[str, dict[Standing, float]]:
    """Stage that has begun in some hypothesis -> standing -> probability."""
    found: dict[str, dict[Standing, float]] = {}
    for weighted in posterior.hypotheses.values():
        for stage, standing in standings(weighted.value).items():
            chances = found.setdefault(stage, {})
            chances[standing] = chances.get(standing, 0.0) + weighted.mass
    for chances in found.values():
        chances[NOT_BEGUN] = max(0.0, 1.0 - sum(chances.values()))
    return found


def likeliest_standing(chances: Mapping[Standing, float]) -> Standing:
    """The most likely standing of a stage: first its progress (pending, active or past), then its status."""
    progress = {p: sum(m for (q, _), m in chances.items() if q is p) for p in Progress}
    place = max(Progress, key=lambda p: round(progress[p], DIGITS))
    standing = max((s for s in chances if s[0] is place), key=lambda s: round(chances[s], DIGITS))
    lead = progress[place] - progress[Progress.PENDING]
    waits = standing == (Progress.UNDER_WAY, Status.ACTIVE)
    return NOT_BEGUN if waits and round(lead, WAITING_DIGITS) <= 0.0 else standing


def stage_beliefs(
    model: MonitoredPhases, posterior: TaskHypotheses, snapshot: TaskSnapshot
) -> Iterator[StageBelief]:
    """The belief about each stage over all hypotheses, in the order of the task."""
    marginals = stage_marginals(posterior)
    for stage in stage_names(model.task):
        chances = marginals.get(stage, {NOT_BEGUN: 1.0})
        standing = likeliest_standing(chances)
        if standing == NOT_BEGUN:
            yield StageBelief(stage, Status.PENDING, 0.0, chances[standing])
            continue
        hypotheses = (w.value for w in posterior.hypotheses.values())
        teller = next(h for h in hypotheses if standings(h).get(stage) == standing)
        belief = _stage_belief(model, teller, stage, snapshot)
        yield replace(belief, confidence=chances[standing] * belief.confidence)


def _stage_belief(
    model: MonitoredPhases, hypothesis: TaskHypothesis, stage: str, snapshot: TaskSnapshot
) -> StageBelief:
    """The belief of one hypothesis about a stage that has begun in it."""
    now = snapshot.mind.time
    past = next((p for p in hypothesis.past if p.stage == stage), None)
    leaf = hypothesis.under_way.get(stage)
    if leaf is None or (past is not None and past.status is Status.FAILED):
        assert past is not None
        done = past.status is Status.DONE and past.since < now
        return replace(past, evidence=in_retrospect(past.evidence, past.since)) if done else past
    monitor, meaning = leaf.payload, model.actions[leaf.step.action]
    if hypothesis.finished is not None:
        _, why = outcome(leaf.step, meaning, monitor, hypothesis.finished)
        return StageBelief(stage, Status.DONE, hypothesis.finished, monitor.confidence, why)
    pause = _pause(hypothesis, stage, snapshot)
    if pause is not None and monitor.status not in BAD:
        why = paused_by(pause, model.task, model.actions)
        return StageBelief(stage, Status.PAUSED, pause.spans[-1][0], monitor.confidence, why)
    why = evidence(leaf.step, meaning, monitor, now, model.actions)
    begun = monitor.begun is not None
    return StageBelief(stage, monitor.status, monitor.since, monitor.confidence, why, begun)


def _pause(hypothesis: TaskHypothesis, stage: str, snapshot: TaskSnapshot) -> Pause | None:
    """The pause of a stage whose active steps are all paused, or None."""
    steps = (x.step for x in leaves(hypothesis.state) if x.step.stage == stage)
    pauses = [snapshot.pauses.now(s.pauses) for s in steps]
    return pauses[0] if pauses and all(p is not None for p in pauses) else None


def _outcome(posterior: TaskHypotheses) -> tuple[Verdict, float, TaskHypothesis]:
    """The most likely verdict, its probability, and the most likely hypothesis with it.

    Whether an unfinished task has begun is decided only if it is likely to be unfinished.
    """
    chances = posterior.marginals(lambda _, h: (_verdict(h),))
    ended = {v: chances.get(v, 0.0) for v in (Verdict.FAILED, Verdict.SUCCEEDED)}
    going_on = {v: chances.get(v, 0.0) for v in (Verdict.IN_PROGRESS, Verdict.UNKNOWN)}
    verdict = max(ended, key=lambda v: round(ended[v], DIGITS))
    if round(sum(going_on.values()), DIGITS) >= round(ended[verdict], DIGITS):
        verdict = max(going_on, key=lambda v: round(going_on[v], DIGITS))
    hypotheses = (w.value for w in posterior.hypotheses.values())
    return verdict, chances[verdict], next(h for h in hypotheses if _verdict(h) is verdict)


def _verdict(hypothesis: TaskHypothesis) -> Verdict:
    if any(status is Status.FAILED for _, status in standings(hypothesis).values()):
        return Verdict.FAILED
    if hypothesis.finished is not None:
        return Verdict.SUCCEEDED
    bad = any(x.payload.status in BAD for x in hypothesis.under_way.values())
    return Verdict.IN_PROGRESS if hypothesis.begun or bad else Verdict.UNKNOWN


def _why(
    verdict: Verdict,
    teller: TaskHypothesis,
    stages: tuple[StageBelief, ...],
    current: str | None,
) -> str:
    """Why the verdict is what it is: one clause."""
    if verdict is Verdict.UNKNOWN:
        return "no part of the task has been seen yet"
    if verdict is Verdict.SUCCEEDED:
        return f"all stages were done at {teller.finished:.1f} s"
    if verdict is Verdict.FAILED:
        failed = [s for s, (_, status) in standings(teller).items() if status is Status.FAILED]
        return next((s.evidence for s in stages if s.stage in failed), "")
    bad = next((s for s in stages if s.status in BAD), None)
    deciding = bad or next((s for s in stages if s.stage == current), None)
    return deciding.evidence if deciding else ""


def _under_way(posterior: TaskHypotheses) -> dict[str, float]:
    """Stage -> probability that it is active, in the order of the most likely hypotheses."""
    return posterior.marginals(lambda _, h: () if h.finished is not None else h.under_way)


def _current(posterior: TaskHypotheses) -> str:
    """The stage most likely active; of several at the same time, the one with the worst status."""
    chances = _under_way(posterior)
    most = round(max(chances.values()), DIGITS)
    tied = {s for s, chance in chances.items() if round(chance, DIGITS) == most}
    hypotheses = (w.value for w in posterior.hypotheses.values())
    steps = next(found for h in hypotheses if (found := h.under_way).keys() & tied)
    here = {stage: leaf for stage, leaf in steps.items() if stage in tied}
    return min(here, key=lambda s: WORST_FIRST.index(here[s].payload.status))


def _prospects(
    model: MonitoredPhases, snapshot: TaskSnapshot, near: TaskHypotheses
) -> tuple[Prospect, ...]:
    """The next stages or the end, most likely first, without unlikely ones.

    Rounds of a loop that differ only in a new actor that is not present yet are one prospect.
    """
    chances: dict[str, float] = {}
    awaited: dict[str, str] = {}
    for stage, chance in model.filter.next_stages(near):
        absent = (model.spare[a] for a in called(stage)[1] if a in model.spare)
        kind = "" if snapshot.found(called(stage)[1]) else next(absent, "")
        stage_named = awaited.setdefault(kind, stage) if kind else stage
        chances[stage_named] = chances.get(stage_named, 0.0) + chance
    likely = sorted((s for s in chances.items() if s[1] >= NEAR), key=lambda s: -s[1])
    return tuple(Prospect(stage, min(1.0, chance)) for stage, chance in likely)


def _missing(model: MonitoredPhases, snapshot: TaskSnapshot) -> str:
    there = {model.spare.get(b.actor) for b in snapshot.bindings if b.object_id is not None}
    unbound = (b.actor for b in snapshot.bindings if b.object_id is None)
    waited = (model.spare.get(a, a) for a in unbound if not model.task.actor(a).optional)
    missing = [a for a in dict.fromkeys(waited) if a not in there]
    return f"not found yet: {', '.join(missing)}" if missing else "no part of it has been seen yet"


def _expected(
    model: MonitoredPhases, snapshot: TaskSnapshot, posterior: TaskHypotheses
) -> tuple[Expectation, ...]:
    """The requirements of active steps and of possible next ones, each listed once."""
    asked = dict.fromkeys(a for node in posterior.hypotheses for a in model.requirements(node))
    wanted = (
        Expectation(name, snapshot.objects(actors))
        for actors, names in asked
        if snapshot.found(actors)
        for name in names
    )
    return tuple(dict.fromkeys(wanted))
