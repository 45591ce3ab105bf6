"""`--pace`: so many frames a second are enough."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.cli import Call
from visup.agent.model.errors import SettingsError
from visup.runs.inputs.presets import every_for
from visup.runs.settings import WatchSettings
from visup.runs.wiring import open_video


@given(st.floats(0.1, 100.0), st.floats(1.0, 120.0))
def test_no_fewer_frames_are_looked_at_than_are_enough(enough: float, fps: float) -> None:
    every = every_for(enough, fps)
    assert every >= 1
    assert every == 1 or fps / every >= enough * (1 - 1e-4)
    assert fps / (every + 1) < enough * (1 + 1e-4)  # and not more than need be


@pytest.mark.parametrize(
    ("given_settings", "every"),
    [
        ({}, 1),
        ({"pace": 5.0}, 5),
        ({"pace": 50.0}, 1),
        ({"preset": "orbit"}, 2),
        ({"preset": "orbit", "pace": 25.0}, 1),
        ({"pace": 5.0, "every": 3}, 3),
    ],
)
def test_what_is_said_goes_before_what_suits_the_scene(
    clip: Path, given_settings: dict[str, float | str], every: int
) -> None:
    with open_video(WatchSettings(str(clip), **given_settings)) as source:  # type: ignore[arg-type]
        assert source.every == every


def test_it_is_an_option_of_watch(visup: Call, clip: Path) -> None:
    done = visup("watch", clip, "--pace", "5", "--no-video", "--json")
    assert '"frames": 8' in done.out.splitlines()[-1]
    assert visup("watch", clip, "--pace", "0").code == 2


def test_a_pace_is_more_than_nothing() -> None:
    with pytest.raises(SettingsError, match="--pace"):
        WatchSettings("0", pace=0.0)
