"""Which behaviours are needed, and of what: coarse ones first, closer looks where they matter.

Read in this order: `activation.py` (behaviours that are called by a condition of the rule language),
`attention.py` (objects known well enough are matched less often).
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
