"""`visup eval peers`: how many cases of other tools' own tests come out as theirs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.oracles.peers import qualitative, temporal
from visup.agent.model.errors import SourceError
from visup.evaluation.figures import Progress, silent

OUTCOMES = ("agree", "unknown_at_ends", "other_semantics", "differ", "not_expressible")
FILES: Mapping[str, tuple[str, Callable[[Mapping[str, Any]], str]]] = {
    "temporal.json": ("peer", temporal.outcome_of),
    "qualitative.json": ("calculus", qualitative.outcome_of),
}
"""File -> by what its cases are grouped, and how one comes out."""


def evaluate_peers(folder: Path, *, progress: Progress = silent) -> dict[str, Any]:
    """Judge all cases of a folder.

    Args:
        folder: Holds `temporal.json`, `qualitative.json` or both; see the README beside them.
        progress: Shows what is being done.

    Returns:
        Items by peer and by calculus, and the total: `cases` and how they came out. `differing`
        lists the cases that differ or cannot be said.

    Raises:
        SourceError: There is neither file, or one is no JSON list of cases.
    """
    items: dict[str, Counter[str]] = {}
    told: list[dict[str, str]] = []
    for name, (group, outcome_of) in FILES.items():
        for number, case in enumerate(_cases(folder / name)):
            if number % 500 == 0:
                progress(f"{name}, case {number}")
            outcome = outcome_of(case)
            counts = items.setdefault(case[group], Counter())
            counts.update(("cases", outcome))
            if outcome not in ("agree", "unknown_at_ends"):
                told.append({"id": case["id"], "of": case[group], "outcome": outcome})
    if not items:
        raise SourceError(
            "there are no cases of peers",
            where=str(folder),
            expected=" or ".join(FILES),
            hint="see the README beside the shared data",
        )
    rows = {name: _row(counts) for name, counts in sorted(items.items())}
    return {"items": rows, "total": _row(sum(items.values(), Counter())), "differing": told}


def _row(counts: Counter[str]) -> dict[str, int]:
    return {key: counts[key] for key in ("cases", *OUTCOMES)}


def _cases(path: Path) -> list[dict[str, Any]]:
    if not path.is_file():
        return []
    try:
        cases: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as fault:
        raise SourceError(f"the cases cannot be read: {fault}", where=str(path)) from None
    return cases
