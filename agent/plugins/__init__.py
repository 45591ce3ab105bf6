"""Behaviours that are found by name, by file or by module path, and made with their settings.

Read `factory.py` (what makes a behaviour), `registry.py` (installed ones, by name) and `settings.py`
(their settings, from the command line or a TOML file).
"""

from visup.agent.plugins.factory import BehaviourFactory, find_factories, load_behaviours
from visup.agent.plugins.registry import Registry, discover_behaviours

__all__ = [
    "BehaviourFactory",
    "Registry",
    "discover_behaviours",
    "find_factories",
    "load_behaviours",
]
