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

CONDITIONS_PER_REPLAY = 25
"""Conditions per replay."""


@dataclass(slots=True)
class FindComparison:
    """Counts of compared truth values and of differences.

    Attributes:
        verdicts: Number of compared truth values (condition, objects, step).
        different: Number of differences, including hits in a skipped run.
        scanned: Pairs of condition and run that had to be evaluated.
        pairs: All pairs of condition and run.
        quick: Pairs evaluated without replaying the reasoning.
        examples: Conditions with differences.
    """

    verdicts: int = 0
    different: int = 0
    scanned: int = 0
    pairs: int = 0
    quick: int = 0
    examples: set[str] | None = None

    def add(self, text: str, same: bool) -> None:
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
    comparison = FindComparison()
    texts = random_conditions(formulas, seed)
    for first in range(0, formulas, CONDITIONS_PER_REPLAY):
        progress(f"condition {first} of {formulas}")
        _compare(
            lake, texts[first : first + CONDITIONS_PER_REPLAY], scratch / "all.rules", comparison
        )
    return {
        "formulas": formulas,
        "verdicts": comparison.verdicts,
        "different": comparison.different,
        "quick": comparison.quick / max(1, comparison.pairs),
        "scanned": comparison.scanned / max(1, comparison.pairs),
        "examples": sorted(comparison.examples or ()),
    }


def _compare(lake: Lake, texts: Sequence[str], rules: Path, comparison: FindComparison) -> None:
    rules.write_text(
        "\n".join(
            f'rule f{number}(a, b): info when {text} say "."' for number, text in enumerate(texts)
        )
    )
    searches = [ConditionSearch(read_pattern(text)) for text in texts]
    with open_database(lake) as database:
        possible = [set(search.possible_runs(database)) for search in searches]
    for run in lake.runs():
        recording, settings = lake.recorded(run)
        evaluators = [PatternEvaluator(search.pattern) for search in searches]

        def compare_step(step: Step, evaluators: list[PatternEvaluator] = evaluators) -> None:
            for number, evaluator in enumerate(evaluators):
                _compare_step(step, evaluator, f"f{number}", texts[number], comparison)

        replay(recording, replace(settings, rules=(rules,)), on_step=compare_step)
        for number, evaluator in enumerate(evaluators):
            hits = tuple(hit for hit in evaluator.hits() if hit.truth == Truth.TRUE)
            comparison.add(texts[number], not hits or run in possible[number])
            if searches[number].quick:
                comparison.quick += 1
                comparison.add(texts[number], searches[number].hits(recording, settings) == hits)
            comparison.scanned += run in possible[number]
            comparison.pairs += 1


def _compare_step(
    step: Step, evaluator: PatternEvaluator, rule: str, text: str, comparison: FindComparison
) -> None:
    evaluator(step)
    rule_verdicts = verdicts(step.mind, rule)
    assert evaluator.before is not None
    for reading in evaluator.before.readings:
        objects = dict(zip(evaluator.pattern.rule.variables, reading.objects, strict=True))
        comparison.add(text, reading.truth == rule_verdicts[objects["a"], objects["b"]])
