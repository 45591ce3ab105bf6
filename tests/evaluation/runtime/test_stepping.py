"""The evaluation of stepping: its figures, its bars, and what it refuses."""

from __future__ import annotations

import pytest

from visup.agent.model.errors import SettingsError
from visup.evaluation.runtime.stepping import evaluate_stepping, missed_bars


def test_a_short_timeline_has_all_figures_and_meets_the_bars(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    small = {"MIN_STEPS": 150, "BACK_STEPS": 60, "BLOCK": 10, "BLOCKS": 2, "VISITS": 4}
    for name, value in small.items():
        monkeypatch.setattr(f"visup.evaluation.runtime.stepping.{name}", value)
    figures = evaluate_stepping(200)
    assert set(figures["items"]) == {"back", "look", "branch"}
    assert figures["total"]["same"] == 1.0
    assert missed_bars({**figures, "total": {**figures["total"], "kept_mb": 1.0}}) == []
    with pytest.raises(SettingsError, match="--steps is 10"):
        evaluate_stepping(10)


def test_missed_bars_are_listed() -> None:
    items = {"back": {"median_ms": 90.0, "most_ms": 250.0}}
    sentences = missed_bars({"items": items, "total": {"kept_mb": 300.0, "same": 0.5}})
    assert [t.split(" the bar")[0] for t in sentences] == [
        "back(500) took 250 ms,",
        "10000 steps keep 300 MB,",
        "steps after going back differ from those before",
    ]
