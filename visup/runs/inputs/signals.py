"""Signals of a run: tables and brokers, and whether all signals used by rules and tasks are provided."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.percepts.signals import SIGNAL, SignalBehaviour, read_signals
from visup.rules.formula.nodes import SIGNAL_WORDS, calls
from visup.tasks.grammar.structure import signals_named

if TYPE_CHECKING:
    from visup.agent import Contract
    from visup.percepts.signals.behaviour import SignalSource
    from visup.rules.formula.nodes import Rule
    from visup.tasks.grammar.nodes import Task

BROKER = "mqtt:"


def signal_behaviours(places: Sequence[Path | str]) -> list[SignalBehaviour]:
    """The behaviours that provide the signals of a run, if any.

    Args:
        places: Tables (CSV), or brokers as `mqtt:HOST[:PORT]/TOPIC`.

    Raises:
        VisupError: One cannot be read or reached.
    """
    return [SignalBehaviour([_source(str(p)) for p in places])] if places else []


def _source(place: str) -> SignalSource:
    if not place.startswith(BROKER):
        return read_signals(Path(place))
    from visup.percepts.signals.mqtt import MqttSignals

    return MqttSignals(place.removeprefix(BROKER))


def check_signals(
    contracts: Iterable[Contract],
    sources: Iterable[SignalBehaviour],
    rules: Iterable[Rule],
    tasks: Iterable[Task],
) -> None:
    """Check that every signal used by rules and tasks is provided.

    Args:
        contracts: Contracts of all behaviours; a user behaviour with signals may provide any.
        sources: Behaviours for the signals of the settings.
        rules: Rules of the run.
        tasks: Tasks of the run.

    Raises:
        SettingsError: A signal is not provided.
    """
    providers = [c for c in contracts if SIGNAL in c.gives]
    known = frozenset[str]().union(*(b.names for b in sources))
    if len(providers) > len(list(sources)) or (providers and not known):
        return
    for name, user, where in _used_signals(rules, tasks):
        if name in known:
            continue
        what = f"{user} asks for the signal `{name}`, which no source provides"
        near = did_you_mean(name, known) if known else None
        expected = f"one of: {', '.join(sorted(known))}" if known else "`--signal FILE.csv`"
        raise SettingsError(what, where=where or None, expected=expected, hint=near)


def _used_signals(rules: Iterable[Rule], tasks: Iterable[Task]) -> Iterator[tuple[str, str, str]]:
    """Each signal with its user and location."""
    for rule in rules:
        for call in (c for f in rule.formulas for c in calls(f) if c.name in SIGNAL_WORDS):
            if call.name != "signal_known":
                yield call.arguments[0], f"rule '{rule.name}'", rule.file
    for task in tasks:
        for name in signals_named(task):
            yield name, f"task `{task.name}`", task.file
