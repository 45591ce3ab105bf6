"""Finds and creates the user behaviours of a run with their settings.

Their contracts are read in another process. Isolated behaviours are never imported here, unless another one
of the same file is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from visup.agent import Behaviour, Contract
from visup.agent.execution.contracts import read_contracts
from visup.agent.execution.sandbox import CAN_ISOLATE
from visup.agent.model.errors import SettingsError
from visup.agent.plugins.factory import load_behaviours
from visup.agent.plugins.isolated import IsolatedBehaviour
from visup.agent.plugins.registry import discover_behaviours
from visup.runs.settings import WatchSettings

OWN = "visup."
"""Prefix of visup's own modules, whose contracts need no other process."""


@dataclass(frozen=True, slots=True)
class _BehaviourSource:
    """A file or module and the contracts of its behaviours; None if it is imported here anyway."""

    where: str
    contracts: tuple[Contract, ...] | None


def user_behaviours(settings: WatchSettings) -> list[Behaviour]:
    """The behaviours that a run adds to those of visup: installed ones, then those of files and modules.

    Raises:
        BehaviourError: One cannot be found or created.
        SettingsError: A setting is not valid, or belongs to no behaviour.
    """
    registry = discover_behaviours() if settings.plugins else None
    named = [registry.where(name) for name in settings.plugins] if registry else []
    values = settings.plugin_settings
    sources = []
    for where in (*named, *map(str, settings.behaviours)):
        import_here = where.startswith(OWN) or not CAN_ISOLATE
        sources.append(
            _BehaviourSource(where, None if import_here else tuple(read_contracts(where, values)))
        )
    behaviours = [b for source in sources for b in _create(source, settings)]
    _check_known(settings, [b.contract.name for b in behaviours])
    return behaviours


def _create(source: _BehaviourSource, settings: WatchSettings) -> Iterable[Behaviour]:
    values = settings.plugin_settings
    contracts = source.contracts
    isolated = {c.name: c for c in contracts or () if c.isolate or c.name in settings.isolate}
    if contracts is None or len(isolated) < len(contracts):
        for behaviour in load_behaviours(source.where, values):
            if behaviour.contract.name not in isolated:
                yield behaviour
    for name, contract in isolated.items():
        yield IsolatedBehaviour(contract, source.where, values.get(name, {}))


def _check_known(settings: WatchSettings, known: list[str]) -> None:
    for name in settings.plugin_settings:
        if name not in known:
            raise SettingsError(
                f"there is no behaviour called '{name}' to set",
                expected=f"one of: {', '.join(known)}"
                if known
                else "a behaviour that is plugged in",
                hint=None if known else "add it with --behaviour FILE or --plugin NAME",
            )
