"""Which behaviours are needed, and for which objects: coarse ones first, finer ones where they matter.

Read in this order: `activation.py` (behaviours activated by a condition of the rule language),
`attention.py` (objects whose identity is certain are matched less often).
"""

from visup.rules.activation.activation import ActivationReasoner, activation_rules, always_active
from visup.rules.activation.attention import AttentionReasoner, AttentionSettings

__all__ = [
    "ActivationReasoner",
    "AttentionReasoner",
    "AttentionSettings",
    "activation_rules",
    "always_active",
]
