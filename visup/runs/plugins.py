"""Behaviours of the user's own in a run: found, made with their settings."""

from __future__ import annotations

from visup.agent import Behaviour
from visup.agent.model.errors import SettingsError
from visup.agent.plugins.factory import BehaviourFactory, find_factories
from visup.agent.plugins.registry import discover_behaviours
from visup.runs.settings import WatchSettings


def user_behaviours(settings: WatchSettings) -> list[Behaviour]:
    """The behaviours that a run adds to those of visup: installed ones, then those of files and modules.

    Raises:
        BehaviourError: One cannot be found or made.
        SettingsError: A setting is not as it should be, or is for a behaviour that is not there.
    """
    registry = discover_behaviours() if settings.plugins else None
    named = [registry.factory(name) for name in settings.plugins] if registry else []
    own = [offer for where in settings.behaviours for offer in find_factories(str(where))]
    found = [*named, *own]
    known = [_name(offer) for offer in found]
    for name in settings.plugin_settings:
        if name not in known:
            raise SettingsError(
                f"there is no behaviour called '{name}' to set",
                expected=f"one of: {', '.join(known)}"
                if known
                else "a behaviour that is plugged in",
                hint=None if known else "add it with --behaviour FILE or --plugin NAME",
            )
    return [offer.make(settings.plugin_settings.get(_name(offer))) for offer in found]


def _name(offer: BehaviourFactory) -> str:
    return offer.contract.name if offer.contract else offer.where
