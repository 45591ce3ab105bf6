"""The figures of pace: a short run gives all of them, and twenty rules are at work in it."""

import pytest

from visup.agent.model.errors import SettingsError
from visup.evaluation.runtime import pace
from visup.rules.language.parser import parse_rules, shipped_rules


def test_a_short_run_measures_steps_replay_observers_and_minds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pace, "MIN_STEPS", 60)
    monkeypatch.setattr(pace, "WARM_UP_STEPS", 30)
    figures = pace.evaluate_pace(60, kept=40)
    three, ten = (figures["items"][f"{n} objects"] for n in pace.COUNTS)
    assert 0.0 < three["ms_low"] <= three["ms"] < ten["ms"]
    assert three["think_ms"] < three["ms"]
    assert figures["total"]["replay_fps"] > 0.0
    assert 0.0 < figures["total"]["observers"] < 0.1
    with pytest.raises(SettingsError):
        pace.evaluate_pace(59)


def test_twenty_rules_are_measured() -> None:
    assert len(shipped_rules()) + len(parse_rules(pace.RULES)) == 20
