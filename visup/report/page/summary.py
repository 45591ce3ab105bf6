"""The summary of a run in sentences, at the top of the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath

from visup.agent import Alert, Severity, Verdict
from visup.agent.cycle.system_alerts import grave_kinds, verdict_without_task
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.report.records import KeyFrame, ReportedObject, RunData, StateSpan

VERDICT_WORDS: dict[Verdict | None, tuple[str, str]] = {
    Verdict.SUCCEEDED: ("Succeeded", "The task went as intended."),
    Verdict.FAILED: ("Failed", "The task failed."),
    Verdict.INTERRUPTED: ("Interrupted", "Something unsafe or unexpected interrupted it."),
    Verdict.IN_PROGRESS: (
        "In progress",
        "The task was still under way at the end, and nothing was wrong.",
    ),
    Verdict.UNKNOWN: ("Unknown", "The task could not be followed."),
}
WITHOUT_TASK: dict[Verdict | None, tuple[str, str]] = {
    None: ("Nothing unsafe was seen", "There was no task to judge."),
    Verdict.INTERRUPTED: (
        "Something unsafe was seen",
        "There was no task to judge.",
    ),
    Verdict.UNKNOWN: (
        "The scene could not always be watched",
        "There was no task to judge; nothing unsafe was seen in what could be watched.",
    ),
}
SEVERITY_WORDS = {
    Severity.INFO: "info",
    Severity.WARNING: "warning",
    Severity.CRITICAL: "critical",
}
NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")
MAX_NAMED = 4


def verdict_words(run: RunData) -> tuple[str, str]:
    """The verdict in a word, and its meaning."""
    verdict = run.verdict or verdict_without_task(grave_kinds(run.alerts))
    if run.verdict is None and (run.tasks or verdict or not run.frames):
        return "No verdict", "The run was not judged."
    words = VERDICT_WORDS if run.tasks else VERDICT_WORDS | WITHOUT_TASK
    return words[run.verdict]


def title_of(run: RunData) -> str:
    """The title: the last two parts of a path, or the source unchanged."""
    parts = PurePath(run.source).parts
    return "/".join(parts[-2:]) if len(parts) > 2 and "://" not in run.source else run.source


def summary(run: RunData) -> str:
    """One paragraph: the source, the objects, the verdict and its reason."""
    reasons = _reasons(run)
    sentences = [
        _source_sentence(run),
        _objects_sentence(run),
        *reasons,
        _alert_sentence(run.alerts, reasons),
    ]
    return " ".join(s for s in sentences if s)


def name_of(subject: ReportedObject) -> str:
    """The name of an object on the page, such as 'Object 2, spartan'."""
    known = subject.name != UNKNOWN_OBJECT
    return f"Object {subject.id}, {spoken(subject.name)}" if known else f"Object {subject.id}"


def spoken(name: str) -> str:
    """A model's name in a sentence: 'payload_bay' is 'payload bay'."""
    return name.replace("_", " ")


def called(run: RunData, object_id: int) -> str:
    """The name of an object by its number."""
    return next((name_of(s) for s in run.objects if s.id == object_id), f"Object {object_id}")


def span_sentence(span: StateSpan) -> str:
    """'converging from 0.0 to 6.0 s'."""
    return f"{span.value.replace('_', ' ')} from {span.start:.1f} to {span.end:.1f} s"


def picture_words(run: RunData, key: KeyFrame) -> str:
    """A description of a key frame for screen readers."""
    names = [f"{called(run, k.object_id)}" for k in key.closeups if k.object_id is not None]
    objects = f"in view: {'; '.join(names)}" if names else "no object in view"
    return (
        f"Frame {key.frame_index} at {key.time:.1f} s, {objects}. {' '.join(key.captions)}".strip()
    )


def count(n: int, what: str) -> str:
    """'two objects', 'one object', '12 objects'."""
    number = NUMBERS[n] if n < len(NUMBERS) else str(n)
    return f"{number} {what}" if n == 1 else f"{number} {what}s"


def _source_sentence(run: RunData) -> str:
    if not run.frames:
        return "visup saw no frame of this source."
    width, height = run.frame_size
    what = f"visup watched {run.duration:.1f} s of video ({run.frames} frames, {width}×{height})"
    if not run.tasks:
        return f"{what} without a task.{_start_sentence(run)}"
    names = ", ".join(f"“{t.task}”" for t in run.tasks)
    return (
        f"{what} against the task{'s' if len(run.tasks) > 1 else ''} {names}.{_start_sentence(run)}"
    )


def _start_sentence(run: RunData) -> str:
    """When it began in wall-clock time, if known."""
    at = run.clock.text(0.0)
    return f" It began on {at[:10]} at {at[11:19]} UTC." if at else ""


def _objects_sentence(run: RunData) -> str:
    if not run.frames:
        return ""
    if not run.objects:
        return "It followed no object."
    named = [s for s in run.objects if s.name != UNKNOWN_OBJECT]
    text = f"It followed {count(len(run.objects), 'object')}"
    if not named:
        return f"{text}."
    best = sorted(named, key=lambda s: (-s.share, s.id))[:MAX_NAMED]
    names = [f"{spoken(s.name)} ({s.share:.0%})".replace("%", " %") for s in best]
    return f"{text}, believed to be {_listed(names)}."


def _reasons(run: RunData) -> list[str]:
    return [_sentence(t.evidence) for t in run.tasks if t.evidence]


def _alert_sentence(alerts: tuple[Alert, ...], reasons: Sequence[str]) -> str:
    """How many alerts there were, and the first one, unless its reason has been `reasons`."""
    warnings = [a for a in alerts if a.severity > Severity.INFO]
    if not warnings:
        return "No alert was raised."
    first = min(warnings, key=lambda a: (a.opened, a.id))
    verb = "was" if len(warnings) == 1 else "were"
    begins = "" if len(warnings) == 1 else "the first "
    text = f"{count(len(warnings), 'alert')} {verb} raised, {begins}at {first.opened:.1f} s"
    reported = any(reason.rstrip(".").casefold() in first.cause.casefold() for reason in reasons)
    return _sentence(text if reported else f"{text}: {first.cause}")


def _sentence(text: str) -> str:
    """With a capital and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def _listed(names: list[str]) -> str:
    """'a', 'a and b', 'a, b and c'."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
