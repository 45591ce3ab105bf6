"""Presets choose rules, memory and pace, and say why."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.cli import Call
from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import SettingsError
from visup.rules.language.parser import shipped_rules
from visup.rules.safety.reasoner import RuleReasoner
from visup.runs.inputs.presets import PRESETS
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, open_video


@pytest.mark.parametrize("name", PRESETS)
def test_the_rules_of_a_preset_are_those_that_ship_but_for_what_it_leaves_out(name: str) -> None:
    shipped = {r.name for r in shipped_rules()}
    assert PRESETS[name].without <= shipped
    agent = build_agent(WatchSettings("script", preset=name))
    (watched,) = [r.rules for r in agent.reasoners if isinstance(r, RuleReasoner)]
    assert {r.name for r in watched} == shipped - PRESETS[name].without
    agent.close()


def test_rules_of_the_users_own_go_before(tmp_path: Path) -> None:
    own = tmp_path / "own.rules"
    own.write_text('rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n')
    agent = build_agent(WatchSettings("script", preset="traffic", rules=(own,)))
    (watched,) = [r.rules for r in agent.reasoners if isinstance(r, RuleReasoner)]
    assert [r.name for r in watched] == ["seen"]
    agent.close()


@given(st.sampled_from(sorted(PRESETS)), st.floats(1.0, 240.0))
def test_no_preset_looks_at_fewer_frames_than_it_says_it_needs(name: str, fps: float) -> None:
    preset = PRESETS[name]
    every = preset.every(fps)
    assert every >= 1
    assert preset.enough_fps is None or every == 1 or fps / every >= preset.enough_fps - 1e-3


def test_the_pace_is_that_of_the_source_unless_it_is_told(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "fast.avi", moving_disc(40), fps=60.0)
    with open_video(WatchSettings(str(clip), preset="traffic")) as video:
        assert [f.index for f in video] == list(range(0, 40, 4))
    with open_video(WatchSettings(str(clip), preset="traffic", every=3)) as video:
        assert [f.index for f in video] == list(range(0, 40, 3))


def test_a_preset_that_is_none_is_refused() -> None:
    with pytest.raises(SettingsError, match="did you mean 'traffic'"):
        WatchSettings("clip.mp4", preset="trafic")


def test_each_preset_is_explained(visup: Call) -> None:
    told = visup("presets").out
    for preset in PRESETS.values():
        assert preset.about in told
        assert preset.rules_because in told
        assert preset.memory_because in told
        assert preset.pace_because in told


def test_a_run_with_a_preset_ends_well(visup: Call, clip: Path) -> None:
    done = visup("watch", clip, "--preset", "bench", "--no-video")
    assert done.code == 0
