"""`make oracles`: every comparison with an oracle, with small counts; exit code 1 when one fails."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from tests.oracles.hardening.runner import evaluate_hardening
from tests.oracles.reasoning.recognition import compare
from tests.oracles.reasoning.relations import qtc_wrong, rcc8_wrong
from tests.oracles.reasoning.rules import evaluate_rules
from tests.oracles.reasoning.task_files import fuzz
from tests.oracles.runtime.behaviour_faults import evaluate_faults
from tests.oracles.shape.robustness import evaluate_robustness


def _recognition_differs() -> bool:
    agreed = compare(100)
    return max(agreed.worst, agreed.worst_success) > 1e-6 or bool(agreed.other)


def _rules_differ() -> bool:
    items = evaluate_rules(formulas=200)["items"]
    return any(item.get("different") for item in items.values())


COMPARISONS: dict[str, Callable[[], bool]] = {
    "rules as the oracle (and rtamt) says": _rules_differ,
    "RCC-8 by its definition": lambda: rcc8_wrong(1_000, 0) > 0,
    "QTC by its definition": lambda: qtc_wrong(1_000, 0) > 0,
    "recognition as the exact oracle": _recognition_differs,
    "corrupted task files": lambda: fuzz(1_000, 0).failures > 0,
    "corrupted databases and odd masks": lambda: bool(
        evaluate_robustness(files=60, masks=60)["failures"]
    ),
    "damaged files of every kind, and races": lambda: bool(
        evaluate_hardening(count=40, races=10, cuts=100)["failures"]
    ),
    "misbehaving behaviours": lambda: bool(evaluate_faults(count=31)["failures"]),
}
"""What is compared, and whether it fails."""


def main() -> int:
    """Run all comparisons, one line each."""
    failed = 0
    for name, fails in COMPARISONS.items():
        begin = time.perf_counter()
        bad = fails()
        failed += bad
        print(f"{'FAILED' if bad else 'passed'}  {name}  ({time.perf_counter() - begin:.0f} s)")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
