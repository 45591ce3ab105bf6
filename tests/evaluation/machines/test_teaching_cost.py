"""What it costs that things at rest are known, on a short run."""

import pytest

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines import teaching_cost


def test_a_short_run_measures_steps_and_teaching(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(teaching_cost, "WARM_UP_FRAMES", 6)
    monkeypatch.setattr(teaching_cost, "NOISE_IMAGES", 6)
    total = teaching_cost.evaluate_teaching(12)["total"]
    assert total["ms"] > 0.0
    assert total["ms_taught"] < 3.0 * total["ms"]
    assert -0.9 < total["cost"] < 2.0
    assert 0.0 < total["teach_s"] < 5.0


def test_too_few_frames_are_refused() -> None:
    with pytest.raises(SettingsError, match="too few"):
        teaching_cost.evaluate_teaching(2 * teaching_cost.WARM_UP_FRAMES - 1)
