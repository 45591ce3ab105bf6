"""Checks that the narrative of a run is consistent.

Each check takes a narrated run and yields its violations. `python -m tests.narrative FOLDER` prints the
violations of all clips and recorded runs below a folder.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from visup.agent import Event, TaskBelief, Verdict
from visup.agent.model.step import Step
from visup.narrative import Narrative

NAMING = re.compile(
    r"[Oo]bject (\d+)(?:, taken for (?:the|an?) [a-z0-9_ ]+)?,? "
    r"(believed to be|in the part of|is|appears to be|may be) (?:the|an?) ([a-z0-9_ ]+?)(?=[,.]| is\b)"
)
"""Object id, verb, name."""
SPAN = re.compile(r"(?:^|: )(the .+?) (?:has|have) been ([a-z ]+?) since ([\d.]+) s")
ENDED = re.compile(r"(?:^|: )(the .+?) (?:was|were) ([a-z ]+?) until ([\d.]+) s")
BOTH_ENDS = re.compile(r"(?:^|: )(the .+?) (?:was|were) ([a-z ]+?) from ([\d.]+) s to ([\d.]+) s")
PAST_SPAN = re.compile(r"(?:^|: )at ([\d.]+) s (the .+?) had been ([a-z ]+?) since ([\d.]+) s")
EXCLUDING = (
    frozenset({"converging", "diverging"}),
    frozenset({"converging", "touching"}),
    frozenset({"converging", "coupled"}),
    frozenset({"diverging", "coupled"}),
)
UNDONE = "is no longer complete"
TOLERANCE_S = 0.11
"""Times are printed to a tenth of a second."""

LEAVING, RETURNING = ("exit",), ("entry", "reappearance", "found", "noticed")


@dataclass(frozen=True)
class NarratedRun:
    """The narrative of a run, and its beliefs.

    Attributes:
        lines: Lines of the narrative, in order.
        steps: All steps, without their percepts.
    """

    lines: Sequence[Event]
    steps: Sequence[Step]


Check = Callable[[NarratedRun], Iterator[str]]


def name_changes_are_announced(run: NarratedRun) -> Iterator[str]:
    """A new name of an object is announced before it is used."""
    names: dict[int, str] = {}
    for line in run.lines:
        for number, how, name in NAMING.findall(line.text):
            before = names.get(int(number), name)
            if name and how == "believed to be" and name != before:
                yield f"{line.time:.2f} s: object {number} was the {before}: {line.text}"
            if name:
                names[int(number)] = name


def exclusive_relations_do_not_overlap(run: NarratedRun) -> Iterator[str]:
    """No two relations that exclude each other are reported for the same actors and time."""
    spans: list[tuple[str, str, float, float, str]] = []
    for line in run.lines:
        for actors, relation, since in SPAN.findall(line.text):
            spans.append((actors, relation, float(since), line.time, line.text))
        for actors, relation, until in ENDED.findall(line.text):
            earlier_starts = [
                s[2] for s in spans if s[:2] == (actors, relation) and s[2] < float(until)
            ]
            begin = min(float(until) - 0.5, max(earlier_starts, default=math.inf))
            spans.append((actors, relation, begin, float(until), line.text))
        for until, actors, relation, since in PAST_SPAN.findall(line.text):
            spans.append((actors, relation, float(since), float(until), line.text))
        for actors, relation, since, until in BOTH_ENDS.findall(line.text):
            spans.append((actors, relation, float(since), float(until), line.text))
    for n, (actors, relation, since, until, text) in enumerate(spans):
        if since > until + TOLERANCE_S:
            yield f"{actors} {relation}: since {since} s, reported at {until:.2f} s: {text}"
        for other in spans[:n]:
            overlap = min(until, other[3]) - max(since, other[2])
            if other[0] == actors and {relation, other[1]} in EXCLUDING and overlap > TOLERANCE_S:
                yield f"{other[4]} | {text}"


def no_sentence_repeats(run: NarratedRun) -> Iterator[str]:
    """No sentence is repeated within a second."""
    last: dict[str, float] = {}
    for line in run.lines:
        if line.time - last.get(line.text, -10.0) < 1.0:
            yield f"{line.time:.2f} s, twice: {line.text}"
        last[line.text] = line.time


def complete_stages_do_not_fail(run: NarratedRun) -> Iterator[str]:
    """A stage reported as complete fails only after it was reported as begun again, or as undone."""
    complete: set[object] = set()
    for line in run.lines:
        stage = line.data.get("task"), line.data.get("stage")
        if line.kind == "stage_done":
            complete.add(stage)
        elif line.kind in ("stage_started", "stage_revised") or UNDONE in line.text:
            complete.discard(stage)
        elif (
            line.kind in ("stage_failing", "stage_failed", "stage_progressing")
            and stage in complete
        ):
            yield f"{line.time:.2f} s: {line.text}"


def objects_out_of_view_are_not_mentioned(run: NarratedRun) -> Iterator[str]:
    """After an object has left, nothing is reported about it but its return."""
    absent: set[int] = set()
    for line in run.lines:
        if line.kind in RETURNING:
            absent -= set(line.objects)
        if line.kind in ("relation", "coupled", "occlusion") and absent & set(line.objects):
            yield f"{line.time:.2f} s: {line.text}"
        if line.kind in LEAVING:
            absent |= set(line.objects)


def prospects_match_the_verdict(run: NarratedRun) -> Iterator[str]:
    """Probabilities of the next stages add up to at most 1, and that of success fits them and the verdict."""
    for step in run.steps:
        for task in step.mind.tasks:
            yield from (f"{step.time:.2f} s: {task.task}: {x}" for x in _prospects(task))


def failed_stages_match_the_verdict(run: NarratedRun) -> Iterator[str]:
    """A task that has succeeded has no stage that failed; one in progress none that has failed for good."""
    for step in run.steps:
        for task in step.mind.tasks:
            failed = [s.stage for s in task.stages if s.status.value == "failed"]
            if failed and task.verdict in (Verdict.SUCCEEDED, Verdict.IN_PROGRESS):
                yield f"{step.time:.2f} s: {task.task} is {task.verdict}, {failed} failed"


CHECKS: tuple[Check, ...] = (
    name_changes_are_announced,
    exclusive_relations_do_not_overlap,
    no_sentence_repeats,
    complete_stages_do_not_fail,
    objects_out_of_view_are_not_mentioned,
    prospects_match_the_verdict,
    failed_stages_match_the_verdict,
)


def violations(run: NarratedRun) -> list[str]:
    """All violations, with the names of their checks."""
    return [f"{check.__name__}: {x}" for check in CHECKS for x in check(run)]


def narrated(steps: Iterable[Step]) -> NarratedRun:
    """The narrative of some steps."""
    narrative, lines, steps_without_frames = Narrative(), [], []
    for step in steps:
        lines += narrative.lines(step, None)
        steps_without_frames.append(replace(step, frame=None))
    return NarratedRun(
        [
            *lines,
            *(
                narrative.rest(steps_without_frames[-1].time, steps_without_frames[-1].frame_index)
                if steps_without_frames
                else []
            ),
        ],
        steps_without_frames,
    )


def _prospects(task: TaskBelief) -> Iterator[str]:
    total = sum(p.probability for p in task.prospects)
    if total > 1.0 + 1e-6:
        yield f"what comes next adds up to {total:.3f}"
    if task.success is None:
        return
    if task.success > total + 0.02 * (len(task.prospects) + 1):  # the hardly possible is left out
        yield f"ends well with {task.success:.2f}, but something comes next with {total:.2f}"
    if task.verdict is Verdict.IN_PROGRESS and task.success < _share_of_end(task) - 1e-6:
        yield f"ends well with {task.success:.2f}, but is at its end with {_share_of_end(task):.2f}"
    if not -1e-9 <= task.success <= 1.0 + 1e-9:
        yield f"ends well with {task.success}"
    if task.verdict in (Verdict.FAILED, Verdict.INTERRUPTED) and task.success > 0.005:
        yield f"is {task.verdict} and ends well with {task.success:.2f}"
    if task.verdict is Verdict.SUCCEEDED and task.success < 0.5:
        yield f"is {task.verdict} and ends well with {task.success:.2f}"


def _share_of_end(task: TaskBelief) -> float:
    return sum(p.probability for p in task.prospects if not p.stage)
