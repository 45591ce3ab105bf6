"""For authors of behaviours, rules and tasks: clips with ground truth, scripted behaviours, a checker.

>>> from visup.testing import Scripted, check_results
>>> all(f.passed for f in check_results(Scripted("lamp", ("lamp",), lambda frame: 1.0)))
True
"""

from visup.testing.clips import CLIPS, LabelledFrame, crossing, disc, flat, noise, region_of
from visup.testing.contract_checker import CheckResult, check_behaviour, check_results
from visup.testing.scripted import Scripted, ScriptedSource, stub_behaviours

__all__ = [
    "CLIPS",
    "CheckResult",
    "LabelledFrame",
    "Scripted",
    "ScriptedSource",
    "check_behaviour",
    "check_results",
    "crossing",
    "disc",
    "flat",
    "noise",
    "region_of",
    "stub_behaviours",
]
