"""For those who write behaviours, rules and tasks: clips with known truth, scripted behaviours, a checker.

>>> from visup.testing import Scripted, findings
>>> all(f.passed for f in findings(Scripted("lamp", ("lamp",), lambda frame: 1.0)))
True
"""

from visup.testing.clips import CLIPS, Shot, crossing, disc, flat, noise, region_of
from visup.testing.contract_checker import Finding, check_behaviour, findings
from visup.testing.scripted import Scripted, ScriptedSource, stand_ins

__all__ = [
    "CLIPS",
    "Finding",
    "Scripted",
    "ScriptedSource",
    "Shot",
    "check_behaviour",
    "crossing",
    "disc",
    "findings",
    "flat",
    "noise",
    "region_of",
    "stand_ins",
]
