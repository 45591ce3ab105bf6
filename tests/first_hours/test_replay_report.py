"""`visup replay --out` leaves a report, too: with the video's pictures, or with outlines alone."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli import Call


@pytest.mark.parametrize("gone", [False, True])
def test_a_replay_leaves_a_report(visup: Call, clip: Path, tmp_path: Path, gone: bool) -> None:
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    if gone:
        shutil.move(clip, tmp_path / "elsewhere.avi")
    done = visup("replay", tmp_path / "run", "--out", tmp_path / "again")
    assert done.code == 0, done.err
    assert f"Report:  {tmp_path / 'again' / 'report.html'}" in done.out
    assert ("outlines only" in done.out) == gone
    page = (tmp_path / "again" / "report.html").read_text()
    first = (tmp_path / "run" / "report.html").read_text()
    assert page.count("<img") == first.count("<img") > 0
    events = [tmp_path / name / "events.jsonl" for name in ("run", "again")]
    assert events[0].read_bytes() == events[1].read_bytes()


def test_the_pictures_are_those_of_the_run(visup: Call, clip: Path, tmp_path: Path) -> None:
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    assert visup("replay", tmp_path / "run", "--out", tmp_path / "again", "--quiet").code == 0

    def pictures(name: str) -> list[str]:
        parts = (tmp_path / name / "report.html").read_text().split("data:image/jpeg;base64,")[1:]
        return [p.partition('"')[0] for p in parts]

    assert pictures("again") == pictures("run") != []
