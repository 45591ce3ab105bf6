"""Activation and attention: which behaviours run, and for which objects.

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
