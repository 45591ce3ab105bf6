"""How events are told to people, on the terminal and in the report alike."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from visup.agent import Event, Severity

DANGEROUS = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u061c\\u200e\\u200f\\u2028-\\u202e\\u2066-\\u2069\\ud800-\\udfff\\ufeff]+"
)
"""What a terminal obeys instead of showing it: control characters but for tabs and ends of line, marks that
turn the reading order, and halves of characters, which cannot be printed."""

EVENT_KINDS: Mapping[str, str] = {
    "entry": "an object comes into view over the border",
    "noticed": "an object is seen that was not seen before, and did not come over the border",
    "exit": "an object leaves over the border",
    "occlusion": "an object is hidden by another, or by something unknown",
    "reappearance": "a hidden object is seen again",
    "lost": "an object is no longer seen, and nothing tells why",
    "found": "a lost object is seen again",
    "coupled": "two objects move as one",
    "decoupled": "two objects no longer move as one",
    "relation": "two objects approach each other, move apart, and so on",
    "identified": "an object is believed to be something, or something else than before",
    "question": "an operator is asked",
    "answer": "an operator has answered",
    "alert": "an alert opens",
    "alert_closed": "an alert is resolved",
    "task_active": "a task is inferred to be going on",
    "task_inactive": "a task turns out not to be going on",
    "stage_started": "a stage has begun",
    "stage_progressing": "a stage goes well",
    "stage_paused": "a stage is paused",
    "stage_resumed": "a stage goes on after a pause",
    "stage_stalled": "a stage makes no progress",
    "stage_failing": "a stage is failing",
    "stage_failed": "a stage has failed",
    "stage_done": "a stage is complete",
    "stage_unknown": "a stage cannot be judged",
    "stage_revised": "a stage that was said to be complete is believed not to have been",
    "invariant_broken": "what a task says must never, or must always, be so is violated",
    "verdict": "the verdict on a task changes",
}
"""Kind of event -> when visup itself tells it; plug-ins may tell more."""


def worded_once(events: Sequence[Event]) -> list[Event]:
    """Events for people: what has one cause in a step is told once, by the gravest of its events.

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
    """What two events of a step must share to be told as one, whatever its first letter."""
    _, _, reason = event.text.partition(": ")
    if reason and event.severity > Severity.INFO:
        return reason.casefold()
    if reason and event.kind in ("stage_started", "stage_progressing"):
        return f"{event.data.get('task')} {event.data.get('stage')}: {reason}"
    return event.text.casefold()


def prose(text: str) -> str:
    """A sentence as people read it: names of tasks and stages in quotes.

    >>> prose("Stage `captured` is failing.")
    "Stage 'captured' is failing."
    """
    return text.replace("`", "'")


def printable(text: str) -> str:
    r"""A text without what a terminal, or a reader, would be led astray by.

    >>> printable("the \x1b[2Jarm\u202e")
    'the [2Jarm'
    """
    return DANGEROUS.sub("", text)


def escaped_json(value: Any, **options: Any) -> str:
    """A value as JSON; what `printable` takes out stands in it as an escape, so that nothing is lost.

    Args:
        value: JSON-like.
        options: As of `json.dumps`.
    """
    return DANGEROUS.sub(
        lambda found: "".join(f"\\u{ord(c):04x}" for c in found.group()),
        json.dumps(value, **options),
    )
