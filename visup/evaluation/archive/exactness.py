"""Checks that search results in a lake equal a replay with the condition as a rule, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from visup.agent import Truth
from visup.agent.model.step import Step
from visup.archive.finding.pattern import read_pattern
from visup.archive.finding.pattern_evaluator import PatternEvaluator
from visup.archive.finding.search import ConditionSearch
from visup.archive.lake import Lake
from visup.archive.querying.database import open_database
from visup.evaluation.archive.conditions import random_conditions
from visup.evaluation.figures import Progress
from visup.rules.safety.queries import verdicts
from visup.runs.replay import replay

AT_ONCE = 25
"""Conditions per replay."""


@dataclass(slots=True)
class FindComparison:
    """The result of a comparison.

    Attributes:
        verdicts: Number of compared truth values (condition, objects, step).
        different: Number of differences, including hits in a skipped run.
        looked: Pairs of condition and run that had to be evaluated.
        pairs: All pairs of condition and run.
        quick: Pairs evaluated without replaying the reasoning.
        examples: Conditions with differences.
    """

    verdicts: int = 0
    different: int = 0
    looked: int = 0
    pairs: int = 0
    quick: int = 0
    examples: set[str] | None = None

    def note(self, text: str, same: bool) -> None:
        """Count one comparison."""
        self.verdicts += 1
        if not same:
            self.different += 1
            self.examples = {*(self.examples or ()), text}


def compare_find(
    lake: Lake, formulas: int, seed: int, scratch: Path, progress: Progress
) -> dict[str, Any]:
    """Compare search results of random conditions with replays of all runs of a lake.

    Args:
        lake: Recorded runs.
        formulas: Number of conditions.
        seed: Random seed.
        scratch: A folder for rules files.
        progress: Shows what is being done.

    Returns:
        `formulas`, `verdicts`, `different` (0 if correct), `quick` (share evaluated without replaying the
        reasoning), `scanned` (share of runs that had to be evaluated) and `examples` of differences.
    """
    found = FindComparison()
    texts = random_conditions(formulas, seed)
    for first in range(0, formulas, AT_ONCE):
        progress(f"condition {first} of {formulas}")
        _compare(lake, texts[first : first + AT_ONCE], scratch / "all.rules", found)
    return {
        "formulas": formulas,
        "verdicts": found.verdicts,
        "different": found.different,
        "quick": found.quick / max(1, found.pairs),
        "scanned": found.looked / max(1, found.pairs),
        "examples": sorted(found.examples or ()),
    }


def _compare(lake: Lake, texts: Sequence[str], rules: Path, found: FindComparison) -> None:
    rules.write_text(
        "\n".join(f'rule f{n}(a, b): info when {text} say "."' for n, text in enumerate(texts))
    )
    searches = [ConditionSearch(read_pattern(text)) for text in texts]
    with open_database(lake) as database:
        possible = [set(search.possible_runs(database)) for search in searches]
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        judges = [PatternEvaluator(s.pattern) for s in searches]

        def look(step: Step, judges: list[PatternEvaluator] = judges) -> None:
            for n, judge in enumerate(judges):
                _compare_step(step, judge, f"f{n}", texts[n], found)

        replay(recording, replace(settings, rules=(rules,)), on_step=look)
        for n, judge in enumerate(judges):
            hits = tuple(h for h in judge.hits() if h.truth == Truth.TRUE)
            found.note(texts[n], not hits or run in possible[n])
            if searches[n].quick:
                found.quick += 1
                found.note(texts[n], searches[n].hits(recording, settings) == hits)
            found.looked += run in possible[n]
            found.pairs += 1


def _compare_step(
    step: Step, judge: PatternEvaluator, rule: str, text: str, found: FindComparison
) -> None:
    judge(step)
    said = verdicts(step.mind, rule)
    assert judge.before is not None
    for reading in judge.before.readings:
        meant = dict(zip(judge.pattern.rule.variables, reading.objects, strict=True))
        found.note(text, reading.truth == said[meant["a"], meant["b"]])
