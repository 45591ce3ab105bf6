"""The read-only commands of `visup step`: the mind, percepts, explanations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from visup.agent import Observation
from visup.stepping import Stepper
from visup.terminal.display import shown
from visup.terminal.narrator import event_row
from visup.terminal.session_commands import COMMANDS, HELP
from visup.terminal.tables import (
    alerts_list,
    behaviours_table,
    candidates_table,
    objects_table,
    questions_list,
    regions_table,
    relations_table,
    tasks_tree,
)

Words = Sequence[str]
View = Callable[[Stepper, Words], RenderableType]
"""Executes a command, given the words after its name."""

_NO_STEP = Text("no step has been taken yet")


class Refusal(Text):
    """The answer to a command that cannot be carried out."""


def refusal(text: str) -> Refusal:
    """The answer to a command that cannot be carried out."""
    return Refusal(text, style="yellow")


def usage(name: str) -> str:
    """The syntax and the effect of a command."""
    return f"{COMMANDS[name].usage}: {COMMANDS[name].effect}"


def number_in(words: Words) -> int | None:
    """The integer that comes first, or None."""
    return int(words[0]) if words and words[0].isdecimal() else None


def observation_of(stepper: Stepper) -> Observation | None:
    """The percepts of this step."""
    if stepper.paused is not None:
        return stepper.paused.observation
    return None if stepper.last is None else stepper.last.observation


def _help(stepper: Stepper, words: Words) -> RenderableType:
    if not words:
        return Text(HELP)
    found = [c for c in COMMANDS.values() if c.name.startswith(words[0])]
    if not found:
        return refusal(f"'{words[0]}' is not a command; 'help' lists them")
    return Text("\n\n".join(c.text for c in found))


def _why(stepper: Stepper, words: Words) -> RenderableType:
    if not words:
        return Text(COMMANDS["why"].text)
    if words[0] == "not":
        return shown(stepper.why_not(" ".join(words[1:])))
    return shown(stepper.why(" ".join(words)))


def _diff(stepper: Stepper, words: Words) -> RenderableType:
    numbers = [int(w) for w in words if w.isdecimal()]
    if stepper.at == stepper.begin and not numbers:
        return _NO_STEP
    first = numbers[0] if numbers else stepper.at - 1
    return shown(stepper.diff(first, *numbers[1:2]))


def _percepts(stepper: Stepper, words: Words) -> RenderableType:
    observation = observation_of(stepper)
    return shown(observation) if observation else _NO_STEP


def _behaviours(stepper: Stepper, words: Words) -> RenderableType:
    observation = observation_of(stepper)
    return behaviours_table(observation.reports) if observation else _NO_STEP


def _candidates(stepper: Stepper, words: Words) -> RenderableType:
    number = number_in(words)
    belief = stepper.mind.objects.get(number) if number is not None else None
    if belief is None:
        return refusal("which object? 'objects' lists their ids")
    return candidates_table(belief)


def _events(stepper: Stepper, words: Words) -> RenderableType:
    count = number_in(words) if words else 10
    if not count:
        return refusal(usage("events"))
    latest = list(stepper.events(last=stepper.at))[-count:]
    rows = Table.grid(padding=(0, 1))
    for number, event in latest:
        rows.add_row(Text(f"step {number}", style="dim"), event_row(event))
    return rows if latest else Text("none yet")


def _relations(stepper: Stepper, words: Words) -> RenderableType:
    number = number_in(words)
    if words and number is None:
        return refusal(usage("relations"))
    return relations_table(stepper.mind.relations, number)


def _directives(stepper: Stepper, words: Words) -> RenderableType:
    directives = stepper.agent.directives
    return Group(*map(shown, directives)) if directives else Text("no requests")


VIEWS: Mapping[str, View] = MappingProxyType(
    {
        "why": _why,
        "diff": _diff,
        "mind": lambda stepper, _: shown(stepper.mind),
        "percepts": _percepts,
        "regions": lambda stepper, _: regions_table(observation_of(stepper)),
        "objects": lambda stepper, _: objects_table(stepper.mind.objects.values()),
        "candidates": _candidates,
        "questions": lambda stepper, _: questions_list(stepper.mind.questions),
        "relations": _relations,
        "tasks": lambda stepper, _: tasks_tree(stepper.mind),
        "alerts": lambda stepper, _: alerts_list(stepper.mind.alerts),
        "events": _events,
        "directives": _directives,
        "behaviours": _behaviours,
        "help": _help,
    }
)
"""By command name."""
