"""How events are told to people, on the terminal and in the report alike."""

from __future__ import annotations

from collections.abc import Sequence

from visup.agent import Event


def worded_once(events: Sequence[Event]) -> list[Event]:
    """Events for people: of several with the same words (a stage fails, an alert opens) the gravest."""
    gravest: dict[str, Event] = {}
    for event in events:
        held = gravest.get(event.text)
        if held is None or event.severity > held.severity:
            gravest[event.text] = event
    return list(gravest.values())


def prose(text: str) -> str:
    """A sentence as people read it: names of tasks and stages in quotes.

    >>> prose("Stage `captured` is failing.")
    "Stage 'captured' is failing."
    """
    return text.replace("`", "'")
