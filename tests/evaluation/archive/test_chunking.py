"""The effect of chunks is counted event by event, independent of object ids."""

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


def event(time: float, kind: str = "entry", object_ids: tuple[int, ...] = (1,), **data: Any) -> Any:
    return {"time": time, "kind": kind, "objects": list(object_ids), "data": data}


EVENTS = st.lists(
    st.builds(event, st.floats(0, 60), st.sampled_from(["entry", "exit"]), st.just((1,))),
    max_size=12,
)


@given(EVENTS, EVENTS)
def test_each_event_counts_once_on_either_side(whole: list[Any], cut: list[Any]) -> None:
    matched, excess, missed = matching_events(whole, cut, {1: 1})
    assert (matched + missed, matched + excess) == (len(whole), len(cut))
    assert matching_events(whole, whole, {1: 1}) == (len(whole), 0, 0)


@pytest.mark.parametrize(
    ("other", "matched"),
    [
        (event(10.9, "stage_done", (7,), stage="approach", value=2.0), 1),
        (event(11.1, "stage_done", (7,), stage="approach"), 0),
        (event(10.0, "stage_done", (7,), stage="captured"), 0),
        (event(10.0, "stage_done", (1,), stage="approach"), 0),
        (event(10.0, "stage_failed", (7,), stage="approach"), 0),
    ],
)
def test_events_match_by_kind_objects_and_named_details(other: Any, matched: int) -> None:
    one = event(10.0, "stage_done", (1,), stage="approach", value=1.0)
    assert matching_events([one], [other], {7: 1}) == (matched, 1 - matched, 1 - matched)


def test_chunks_that_start_with_the_video_lose_no_event(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
    (tmp_path / "disc").mkdir()
    clip = write_clip(tmp_path / "disc" / "video.mp4", moving_disc(10))
    monkeypatch.setattr(chunking, "mission_settings", lambda *arguments: WatchSettings(str(clip)))
    figures = compare_chunks(tmp_path, [tmp_path / "disc"], tmp_path, silent)
    assert figures["missions"] == 1
    assert (figures["event_f1"], figures["excess"], figures["missed"]) == (1.0, 0, 0)
    assert figures["verdicts"] == 0
    assert figures["longer"] > 1.0  # all chunks look at nearly all
