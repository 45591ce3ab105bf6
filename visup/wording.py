"""The wording of events for people, on the terminal and in the report."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from visup.agent import Event, Severity

DANGEROUS = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069\\ud800-\\udfff\\ufeff]+"
)
"""Characters that a terminal interprets instead of showing: control characters except tab and newline, marks
that change the reading order, and lone surrogates."""

EVENT_KINDS: Mapping[str, str] = {
    "entry": "an object enters the view across the border",
    "noticed": "a new object appears that did not cross the border",
    "exit": "an object leaves the view across the border",
    "occlusion": "an object is hidden by another, or by something unknown",
    "reappearance": "a hidden object is seen again",
    "lost": "an object is no longer seen, for no apparent reason",
    "found": "a lost object is seen again",
    "coupled": "two objects move as one",
    "decoupled": "two objects no longer move as one",
    "relation": "two objects begin to converge, diverge, or keep their distance",
    "identified": "the identity of an object is established, or changes",
    "question": "a question to the operator",
    "answer": "an answer of the operator",
    "alert": "an alert opens",
    "alert_closed": "an alert is resolved",
    "task_active": "a task is inferred to be in progress",
    "task_inactive": "a task turns out not to be in progress",
    "stage_started": "a stage has begun",
    "stage_progressing": "a stage makes progress",
    "stage_paused": "a stage is paused",
    "stage_resumed": "a stage resumes after a pause",
    "stage_stalled": "a stage makes no progress",
    "stage_failing": "a stage is failing",
    "stage_failed": "a stage has failed",
    "stage_done": "a stage is complete",
    "stage_unknown": "a stage cannot be judged",
    "stage_revised": "a stage that was reported complete is now believed to go on, or not to have happened",
    "invariant_broken": "an invariant of a task (`never`, `always`) is violated",
    "verdict": "the verdict on a task changes",
}
"""Kind of event -> when visup reports it; plug-ins may report further kinds."""


def worded_once(events: Sequence[Event]) -> list[Event]:
    """Events for people: events of one step with the same cause are merged into the most severe one.

    With the same words (a stage fails, an alert opens) one is told; so it is with grave ones of the same
    reason (a stage and its task fail, since something was not to be); and a stage that begins and goes on
    for the same reason has begun.
    """
    told: dict[tuple[int, str], Event] = {}
    for event in events:
        key = event.frame_index, _cause(event)
        held = told.get(key)
        if held is None or event.severity > held.severity:
            told[key] = event
    return list(told.values())


def _cause(event: Event) -> str:
    """What two events of a step must share to be merged, regardless of case of the first letter."""
    _, _, reason = event.text.partition(": ")
    if reason and event.severity > Severity.INFO:
        return reason.casefold()
    if reason and event.kind in ("stage_started", "stage_progressing"):
        return f"{event.data.get('task')} {event.data.get('stage')}: {reason}"
    return event.text.casefold()


def prose(text: str) -> str:
    """A sentence for people: names of tasks and stages in quotes.

    >>> prose("Stage `captured` is failing.")
    "Stage 'captured' is failing."
    """
    return text.replace("`", "'")


def printable(text: str) -> str:
    r"""A text without characters that would mislead a terminal or a reader.

    >>> printable("the \x1b[2Jarm\u202e")
    'the [2Jarm'
    """
    return DANGEROUS.sub("", text)


def escaped_json(value: Any, **options: Any) -> str:
    """A value as JSON, with the characters that `printable` removes escaped, so that nothing is lost.

    Args:
        value: JSON-like.
        options: As of `json.dumps`.
    """
    return DANGEROUS.sub(
        lambda found: "".join(f"\\u{ord(c):04x}" for c in found.group()),
        json.dumps(value, **options),
    )
