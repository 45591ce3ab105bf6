"""What a cut costs is counted event by event, whatever numbers objects have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.clips import moving_disc, write_clip
from visup.evaluation.archive import chunking
from visup.evaluation.archive.chunking import compare_chunks, matching_events
from visup.evaluation.figures import silent
from visup.runs.settings import WatchSettings


def event(time: float, kind: str = "entry", who: tuple[int, ...] = (1,), **data: Any) -> Any:
    return {"time": time, "kind": kind, "objects": list(who), "data": data}


EVENTS = st.lists(
    st.builds(event, st.floats(0, 60), st.sampled_from(["entry", "exit"]), st.just((1,))),
    max_size=12,
)


@given(EVENTS, EVENTS)
def test_each_event_counts_once_on_either_side(whole: list[Any], cut: list[Any]) -> None:
    right, excess, missed = matching_events(whole, cut, {1: 1})
    assert (right + missed, right + excess) == (len(whole), len(cut))
    assert matching_events(whole, whole, {1: 1}) == (len(whole), 0, 0)


@pytest.mark.parametrize(
    ("other", "right"),
    [
        (event(10.9, "stage_done", (7,), stage="approach", value=2.0), 1),
        (event(11.1, "stage_done", (7,), stage="approach"), 0),
        (event(10.0, "stage_done", (7,), stage="captured"), 0),
        (event(10.0, "stage_done", (1,), stage="approach"), 0),
        (event(10.0, "stage_failed", (7,), stage="approach"), 0),
    ],
)
def test_what_is_the_same_event(other: Any, right: int) -> None:
    one = event(10.0, "stage_done", (1,), stage="approach", value=1.0)
    assert matching_events([one], [other], {7: 1}) == (right, 1 - right, 1 - right)


def test_a_cut_of_which_each_chunk_has_seen_all_before_costs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
    (tmp_path / "disc").mkdir()
    clip = write_clip(tmp_path / "disc" / "video.mp4", moving_disc(10))
    monkeypatch.setattr(chunking, "mission_settings", lambda *given: WatchSettings(str(clip)))
    found = compare_chunks(tmp_path, [tmp_path / "disc"], tmp_path, silent)
    assert found["missions"] == 1
    assert (found["event_f1"], found["excess"], found["missed"]) == (1.0, 0, 0)
    assert found["verdicts"] == 0
    assert found["longer"] > 1.0  # all chunks look at nearly all
