"""Relations between objects: qualitative spatial relations of all pairs, and zones.

Read in this order: `reasoner.py` (one step, and how to query relations of a mind), `samples.py` (the last
seconds as arrays), `kinematics.py` (gaps, trends, velocities), `thresholds.py` (from quantities to states),
the calculi `rcc8.py`, `qtc.py`, `direction.py`, `distance.py` and `trend.py`, and `zones.py` (parts of the
scene). Compiled: `_kinematics_jit.py` (quantities of pairs), `_thresholds_jit.py` (states of boxes),
`_pair_states_jit.py` (trend, touch, moving together, and the rows of the table of relations).
"""

from visup.rules.relations.kinematics import Kinematics, RelationSettings
from visup.rules.relations.reasoner import RelationReasoner, kinematics, qtc, related
from visup.rules.relations.zones import ZoneReasoner, ZoneSettings

__all__ = [
    "Kinematics",
    "RelationReasoner",
    "RelationSettings",
    "ZoneReasoner",
    "ZoneSettings",
    "kinematics",
    "qtc",
    "related",
]
