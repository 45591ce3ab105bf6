"""Discovery of behaviours by name, file or module path, and their creation with settings.

Read `factory.py` (creates a behaviour), `registry.py` (installed behaviours, by name) and `settings.py`
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
