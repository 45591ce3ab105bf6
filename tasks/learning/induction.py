"""Induction of a task file from good runs, each line with its evidence as a comment.

Events of nearly all runs form the course; those of some runs only are reported and dropped. The file is
validated on every run that it was learned from, and a stage that would refuse one is removed. Bad
runs add invariants against events that never occurred in a good one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from visup.agent import Status, Verdict
from visup.agent.model.errors import TaskError
from visup.tasks.analysis.judging import JudgedRun, judged
from visup.tasks.checks.load import parse_task
from visup.tasks.grammar.nodes import Actor
from visup.tasks.learning.alignment import with_common_counts
from visup.tasks.learning.bodies import with_resting_bodies_merged
from visup.tasks.learning.carrying import with_carrying
from visup.tasks.learning.drafts import (
    Draft,
    event_of,
    stage_names,
)
from visup.tasks.learning.order import (
    Item,
    Occurrence,
    action_text,
    final_of,
    frequent_occurrences,
    plan_of,
    symbols_of,
    with_approaches,
    with_loops,
    without,
)
from visup.tasks.learning.periods import periods_of
from visup.tasks.learning.places import places_of, release_of, with_proximity
from visup.tasks.learning.precedence import precedences
from visup.tasks.learning.relevance import (
    SIMULTANEOUS_S,
    CourseEvent,
    relevant_events,
    with_simultaneous_joined,
)
from visup.tasks.learning.rests import final_rest_of, resting_actors
from visup.tasks.learning.traces import RunTrace, Span

COURSE_SHARE = 0.8
"""Least share of good runs in which an event occurs for it to be part of the course."""
APPROACH_SHARE = 0.6
"""The same for the approach to a meeting that is part of the course."""
FORBIDDEN = ("touching", "coupled")
"""Actions that are forbidden when they occur in bad runs only."""


@dataclass(frozen=True)
class LearnedTask:
    """A learned task.

    Attributes:
        text: The task file.
        good: Its verdict on each good run.
        bad: Its verdict on each bad run.
        dropped: Events of the runs that are not in the file, with the reason.
    """

    text: str
    good: Mapping[str, Verdict]
    bad: Mapping[str, Verdict]
    dropped: tuple[str, ...]


def learn_task(
    name: str,
    good: Sequence[RunTrace],
    bad: Sequence[RunTrace] = (),
    declared: Mapping[str, Actor] | None = None,
) -> LearnedTask:
    """Propose a task file.

    Args:
        name: Of the task.
        good: Runs that succeeded.
        bad: Runs that failed.
        declared: Actors as the runs' own tasks declare them, by name.

    Returns:
        The file and its verdicts on the runs.

    Raises:
        TaskError: The good runs have no event in common.
    """
    rows = _event_sequences(good)
    item_strings, loop_counts = with_loops([tuple(e.item for e in row) for row in rows])
    if not loop_counts:  # without loops, surplus repeats in some runs are noise
        rows = with_common_counts(rows)
        item_strings = [tuple(e.item for e in row) for row in rows]
    core = with_approaches(
        frequent_occurrences(item_strings, COURSE_SHARE),
        frequent_occurrences(item_strings, APPROACH_SHARE),
    )
    if not core:
        raise TaskError(
            "the runs have nothing in common that a task could ask for",
            expected="runs in which named objects approach, touch or couple",
            hint="name objects by --models, --teach or a task with actors, and record again",
        )
    all_occurrences = {o for w in item_strings for o in frequent_occurrences([w], 1.0)}
    dropped = [
        f"{_occurrence_text(o)}: in some runs only"
        for o in sorted(all_occurrences - set(core), key=repr)
    ]
    plan = plan_of(item_strings, core, partial(_order_may_be_random, rows))
    periods = periods_of(loop_counts, rows)
    draft = Draft(name, plan, loop_counts, good, rows, declared or {}, periods=periods)
    draft.release = release_of(plan, rows)
    results = _relaxed_until_valid(draft, dropped)
    _add_invariants(draft, results)
    bad_verdicts = {r.name: _verdict(draft, r) for r in bad}
    for run in bad:
        if bad_verdicts[run.name] is Verdict.SUCCEEDED:
            _forbid_events_of(draft, run)
    if draft.forbidden:
        bad_verdicts = {r.name: _verdict(draft, r) for r in bad}
        results = {r.name: _verdict(draft, r) for r in good}
    return LearnedTask(draft.text(), results, bad_verdicts, tuple(dropped))


def _event_sequences(runs: Sequence[RunTrace]) -> list[list[CourseEvent]]:
    """The relevant events of each run, with carrying, retreats and stays near each other added."""
    rows = with_resting_bodies_merged(relevant_events(runs), runs)
    rows = with_carrying(with_simultaneous_joined(rows), runs)
    return with_proximity(rows, runs)


def _relaxed_until_valid(draft: Draft, dropped: list[str]) -> dict[str, Verdict]:
    """Relax the draft until it accepts all good runs, as far as possible; returns their verdicts."""
    while True:
        judged_runs = {r.name: _judged(draft, r) for r in draft.runs if r.minds}
        refused = [j for j in judged_runs.values() if j.verdict is not Verdict.SUCCEEDED]
        failing = _failing_stage(draft, refused[0]) if refused else None
        if refused and draft.release is not None and failing in (None, final_of(draft.plan)):
            draft.release = None
            continue
        if refused and draft.periods:
            draft.periods = {}
            continue
        if refused and draft.carrying_may_fail:
            draft.carrying_may_fail = False
            continue
        if refused and draft.last_stage_holds:
            draft.last_stage_holds = False
            continue
        if failing is None:
            return {name: j.verdict for name, j in judged_runs.items()}
        plan = without(draft.plan, failing)
        if plan is None:
            return {name: j.verdict for name, j in judged_runs.items()}
        dropped.append(f"{_occurrence_text(failing)}: a good run would be refused by it")
        draft.plan = plan


def _add_invariants(draft: Draft, results: Mapping[str, Verdict]) -> None:
    """Add what held in all good runs (order, places, rest), unless it changes a verdict of one."""
    draft.precedences = tuple(precedences(draft.plan, draft.rows, draft.runs))
    if draft.precedences and _verdicts(draft) != dict(results):
        draft.precedences = ()
    if (
        not draft.periods
    ):  # a rhythm out of time fails softly, and a further stage would outweigh it
        _add_final_places(draft, results)
    draft.resting_actors = tuple(resting_actors(draft.runs, draft.actors()))
    if draft.resting_actors and _verdicts(draft) != dict(results):
        draft.resting_actors = ()


def _add_final_places(draft: Draft, results: Mapping[str, Verdict]) -> None:
    """Add the final places and the final rest, unless they change a verdict."""
    last = (
        draft.release.spans(draft.rows, draft.runs)
        if draft.release is not None
        else _last_spans(draft)
    )
    if last:
        found = places_of(draft.plan, draft.rows, draft.runs, last, draft.release)
        draft.places = tuple(found)
    if draft.places and _verdicts(draft) != dict(results):
        draft.places = ()
    final = final_of(draft.plan)
    if draft.last_stage_holds and final is not None:
        draft.final_rest = final_rest_of(draft.runs, final)
        if draft.final_rest is not None and _verdicts(draft) != dict(results):
            draft.final_rest = None


def _last_spans(draft: Draft) -> list[Span]:
    """From the end of the last stage but one to that of the last, in each run; empty if some run has none."""
    names = list(stage_names(draft.plan).values())[-2:]
    spans = [_judged(draft, r).spans() for r in draft.runs if r.minds]
    if (
        len(names) < 2
        or len(spans) < len(draft.runs)
        or any(n not in s for s in spans for n in names)
    ):
        return []
    return [(s[names[0]][1], s[names[1]][1]) for s in spans]


def _verdicts(draft: Draft) -> dict[str, Verdict]:
    return {r.name: _verdict(draft, r) for r in draft.runs if r.minds}


def _failing_stage(draft: Draft, run: JudgedRun) -> Occurrence | None:
    """The stage that refuses a run: the first one that is not done."""
    for occurrence, name in stage_names(draft.plan).items():
        if run.statuses.get(name) is not Status.DONE:
            return occurrence
    return None


def _verdict(draft: Draft, run: RunTrace) -> Verdict:
    return _judged(draft, run).verdict


def _judged(draft: Draft, run: RunTrace) -> JudgedRun:
    """What the draft makes of a run; it is often asked again when nothing was added to the draft."""
    key = draft.text(), id(run)
    if key not in draft.judged_runs:
        draft.judged_runs[key] = judged(parse_task(key[0]), run.minds)
    return draft.judged_runs[key]


def _forbid_events_of(draft: Draft, run: RunTrace) -> None:
    """Forbid events that occurred in a bad run and in no good one."""
    allowed = {interval.symbol for r in draft.runs for interval in r.intervals}
    actors = {a for r in draft.runs for interval in r.intervals for a in interval.symbol[1]}
    for interval in run.intervals:
        action, pair = interval.symbol
        new = interval.symbol not in allowed and interval.symbol not in draft.forbidden
        if new and action in FORBIDDEN and actors.intersection(pair):
            draft.forbidden.append(interval.symbol)


def _order_may_be_random(
    rows: Sequence[Sequence[CourseEvent]], a: Occurrence, b: Occurrence
) -> bool:
    """Whether two occurrences are so close in some run that their order may be random."""
    events = [(event_of(row, a), event_of(row, b)) for row in rows]
    pairs = [(x, y) for x, y in events if x is not None and y is not None]
    if any(_pairs(x.item) & _pairs(y.item) for x, y in pairs):
        return False
    return any(abs(x.at - y.at) < SIMULTANEOUS_S for x, y in pairs)


def _pairs(item: Item) -> set[tuple[str, ...]]:
    return {actors for _, actors in symbols_of(item)}


def _occurrence_text(occurrence: Occurrence) -> str:
    return action_text(occurrence[0])
