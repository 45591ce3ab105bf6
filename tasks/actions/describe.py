"""Descriptions of actions for lists and editors."""

from __future__ import annotations

from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.grammar.units import UNITS

NAMES = {"object": ("a", "b", "c"), "zone": ("zone", "zone", "zone")}
NAMES |= {"signal": ("battery", "battery", "battery"), "word": ("mode", "auto", "auto")}


def written(meaning: ActionDefinition) -> str:
    """The syntax of an action, with letters for its actors: `gap(a, b) < 5 px`."""
    actors = ", ".join(NAMES.get(k, NAMES["object"])[i] for i, k in enumerate(meaning.kinds))
    unit = next((u for u, (d, by) in UNITS.items() if (d, by) == (meaning.measures, 1.0)), "%")
    compared = f" < 5 {unit}" if meaning.measures else ""
    return f"{meaning.name}({actors}){compared}"


def described(meaning: ActionDefinition) -> str:
    """A description of an action in Markdown: its syntax, and when it holds, ends and fails."""
    lines = [f"`{written(meaning)}`", meaning.about or meaning.text]
    if meaning.measures:
        lines.append(f"A quantity; it measures: {meaning.measures.replace('_', ' ')}.")
        return "\n\n".join(lines)
    over = f"it has held for {meaning.hold_s:g} s"
    lines.append(f"Over when {'what comes next begins' if meaning.lasts else over}.")
    if meaning.contrary:
        contrary = " or ".join(c.replace("_", " ") for c in meaning.contrary)
        lines.append(f"Fails when they are {contrary}.")
    return "\n\n".join(lines)
