"""False alarms are counted by kind; alarms that the ground truth expects do not count."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import cv2
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.percepts.motion.clips import clip, texture
from visup.agent.model.errors import SettingsError
from visup.evaluation.alarms.runner import AlarmCounts, alarm_rates, evaluate_alarms

ALARM_COUNTS = st.dictionaries(st.sampled_from("abc"), st.integers(1, 9))


@given(st.lists(st.tuples(ALARM_COUNTS, st.floats(1.0, 1e4)), min_size=1, max_size=6))
def test_rates_add_up_over_clips_and_kinds(clips: list[tuple[dict[str, int], float]]) -> None:
    counts = {
        str(n): AlarmCounts(Counter(alarms), Counter(), seconds)
        for n, (alarms, seconds) in enumerate(clips)
    }
    figures = alarm_rates(counts)
    total, items = figures["total"], figures["items"]
    assert total["alarms"] == sum(i["alarms"] for i in items.values())
    assert total["per_hour"] == pytest.approx(sum(i["per_hour"] for i in items.values()))
    assert total["clips"] == len(figures["raised"]) <= len(clips)
    assert all(1 <= i["clips"] <= i["alarms"] for i in items.values())


def test_a_still_scene_raises_no_alarm(tmp_path: Path) -> None:
    folder = tmp_path / "still" / "frames"
    folder.mkdir(parents=True)
    for labelled in clip(texture(1, (120, 160), 0, 255), lambda n: (8, 8), [], 12):
        cv2.imwrite(str(folder / f"{labelled.frame.index:05d}.png"), labelled.frame.image)
    figures = evaluate_alarms(tmp_path, limit=10)
    assert figures["items"] == {}
    assert figures["total"]["alarms"] == 0
    assert figures["total"]["hours"] > 0
    json.dumps(figures)


def test_a_folder_without_footage_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="no video"):
        evaluate_alarms(tmp_path)
