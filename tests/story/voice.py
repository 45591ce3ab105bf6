"""Laws of one voice: what is told of a run agrees with itself.

Each law takes what was told, line by line, and gives back what breaks it. `python -m tests.story FOLDER`
prints what breaks a law in the clips and recorded runs below a folder.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from visup.agent import Event, TaskBelief, Verdict
from visup.agent.model.step import Step
from visup.story import Narrative

MENTION = re.compile(
    r"[Oo]bject (\d+)(?:, taken for (?:the|an?) [a-z0-9_ ]+)?,? "
    r"(believed to be|in the part of|is|appears to be|may be) (?:the|an?) ([a-z0-9_ ]+?)(?=[,.]| is\b)"
)
"""Id, how it is called so, and what."""
SPAN = re.compile(r"(?:^|: )(the .+?) (?:has|have) been ([a-z ]+?) since ([\d.]+) s")
ENDED = re.compile(r"(?:^|: )(the .+?) (?:was|were) ([a-z ]+?) until ([\d.]+) s")
BOTH_ENDS = re.compile(r"(?:^|: )(the .+?) (?:was|were) ([a-z ]+?) from ([\d.]+) s to ([\d.]+) s")
AT_AN_END = re.compile(r"(?:^|: )at ([\d.]+) s (the .+?) had been ([a-z ]+?) since ([\d.]+) s")
EXCLUDING = (
    frozenset({"converging", "diverging"}),
    frozenset({"converging", "touching"}),
    frozenset({"converging", "coupled"}),
    frozenset({"diverging", "coupled"}),
)
UNDONE = "is no longer complete"
TOLERANCE_S = 0.11
"""Times are told to a tenth of a second."""

AWAY, BACK = ("exit",), ("entry", "reappearance", "found", "noticed")


@dataclass(frozen=True)
class Told:
    """What a run told, and what it believed.

    Attributes:
        lines: Lines of the narrative, in order.
        steps: All steps, without their percepts.
    """

    lines: Sequence[Event]
    steps: Sequence[Step]


Law = Callable[[Told], Iterator[str]]


def a_name_changes_only_with_a_word(told: Told) -> Iterator[str]:
    """Who is called otherwise than before is told to be so."""
    names: dict[int, str] = {}
    for line in told.lines:
        for number, how, name in MENTION.findall(line.text):
            before = names.get(int(number), name)
            if name and how == "believed to be" and name != before:
                yield f"{line.time:.2f} s: object {number} was the {before}: {line.text}"
            if name:
                names[int(number)] = name


def times_that_are_told_exclude_each_other_rightly(told: Told) -> Iterator[str]:
    """Of the same actors no two relations that exclude each other are told for the same time."""
    spans: list[tuple[str, str, float, float, str]] = []
    for line in told.lines:
        for who, what, since in SPAN.findall(line.text):
            spans.append((who, what, float(since), line.time, line.text))
        for who, what, until in ENDED.findall(line.text):
            told_since = [s[2] for s in spans if s[:2] == (who, what) and s[2] < float(until)]
            begin = min(float(until) - 0.5, max(told_since, default=math.inf))
            spans.append((who, what, begin, float(until), line.text))
        for until, who, what, since in AT_AN_END.findall(line.text):
            spans.append((who, what, float(since), float(until), line.text))
        for who, what, since, until in BOTH_ENDS.findall(line.text):
            spans.append((who, what, float(since), float(until), line.text))
    for n, (who, what, since, until, text) in enumerate(spans):
        if since > until + TOLERANCE_S:
            yield f"{who} {what}: since {since} s, told at {until:.2f} s: {text}"
        for other in spans[:n]:
            overlap = min(until, other[3]) - max(since, other[2])
            if other[0] == who and {what, other[1]} in EXCLUDING and overlap > TOLERANCE_S:
                yield f"{other[4]} | {text}"


def nothing_is_told_twice_at_once(told: Told) -> Iterator[str]:
    """No sentence comes again within a second."""
    last: dict[str, float] = {}
    for line in told.lines:
        if line.time - last.get(line.text, -10.0) < 1.0:
            yield f"{line.time:.2f} s, twice: {line.text}"
        last[line.text] = line.time


def what_is_done_is_not_failing(told: Told) -> Iterator[str]:
    """A stage that was told complete fails only once it was told to have begun again, or to be undone."""
    done: set[object] = set()
    for line in told.lines:
        stage = line.data.get("task"), line.data.get("stage")
        if line.kind == "stage_done":
            done.add(stage)
        elif line.kind in ("stage_started", "stage_revised") or UNDONE in line.text:
            done.discard(stage)
        elif line.kind in ("stage_failing", "stage_failed", "stage_progressing") and stage in done:
            yield f"{line.time:.2f} s: {line.text}"


def who_has_left_does_nothing(told: Told) -> Iterator[str]:
    """Of who has left nothing is told but that it comes back."""
    away: set[int] = set()
    for line in told.lines:
        if line.kind in BACK:
            away -= set(line.objects)
        if line.kind in ("relation", "coupled", "occlusion") and away & set(line.objects):
            yield f"{line.time:.2f} s: {line.text}"
        if line.kind in AWAY:
            away |= set(line.objects)


def prospects_agree_with_the_verdict(told: Told) -> Iterator[str]:
    """What is over ends as it did; what comes next is shares of one whole, and success a part of it."""
    for step in told.steps:
        for task in step.mind.tasks:
            yield from (f"{step.time:.2f} s: {task.task}: {x}" for x in _prospects(task))


def a_stage_fails_as_its_task_does(told: Told) -> Iterator[str]:
    """A task that has succeeded has no stage that failed; one in progress none that has failed for good."""
    for step in told.steps:
        for task in step.mind.tasks:
            bad = [s.stage for s in task.stages if s.status.value == "failed"]
            if bad and task.verdict in (Verdict.SUCCEEDED, Verdict.IN_PROGRESS):
                yield f"{step.time:.2f} s: {task.task} is {task.verdict}, {bad} failed"


LAWS: tuple[Law, ...] = (
    a_name_changes_only_with_a_word,
    times_that_are_told_exclude_each_other_rightly,
    nothing_is_told_twice_at_once,
    what_is_done_is_not_failing,
    who_has_left_does_nothing,
    prospects_agree_with_the_verdict,
    a_stage_fails_as_its_task_does,
)


def breaches(told: Told) -> list[str]:
    """All that breaks a law, with the name of the law."""
    return [f"{law.__name__}: {x}" for law in LAWS for x in law(told)]


def told_of(steps: Iterable[Step]) -> Told:
    """What the narrative tells of steps."""
    narrative, lines, kept = Narrative(), [], []
    for step in steps:
        lines += narrative.lines(step, None)
        kept.append(replace(step, frame=None))
    return Told(
        [*lines, *(narrative.rest(kept[-1].time, kept[-1].frame_index) if kept else [])], kept
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
