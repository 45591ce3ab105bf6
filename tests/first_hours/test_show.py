"""`show` of a session: the frame with what is believed drawn over it, live and of a recorded run."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.cli import Call
from tests.first_hours.test_sessions import piped


def test_the_same_picture_is_shown_live_and_of_the_run(
    visup: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    for name, source in (("live.png", clip), ("run.png", tmp_path / "run")):
        piped(monkeypatch, "step 30", f"show {name}")
        done = visup("step", source)
        assert done.code == 0, done.out
        assert f"{name}: 96 x 72 pixels" in done.out
    live, run = (cv2.imread(str(tmp_path / n)) for n in ("live.png", "run.png"))
    assert live is not None
    assert run is not None
    np.testing.assert_array_equal(live, run)
    raw = cv2.VideoCapture(str(clip))
    assert not any(np.array_equal(live, raw.read()[1]) for _ in range(40))  # something is drawn


def test_what_cannot_be_shown_is_told(
    visup: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    piped(monkeypatch, "show")
    assert "no step has been taken yet" in visup("step", clip).out
    piped(monkeypatch, "step 3", "show no/such/folder.png")
    done = visup("step", clip)
    assert "the picture cannot be written" in done.out
    assert done.code == 2
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    clip.unlink()
    piped(monkeypatch, "step 3", "show")
    assert "cannot be read again" in visup("step", tmp_path / "run").out


def test_what_an_answer_rests_on_is_marked_in_its_frame(
    visup: Call, clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    piped(monkeypatch, "step 30", "show why object 1 why.png", "show plain.png")
    done = visup("step", clip)
    assert done.code == 0, done.out
    why, plain = (cv2.imread(str(tmp_path / n)) for n in ("why.png", "plain.png"))
    assert why is not None
    assert plain is not None
    assert why[:20, :20].mean() < 0.5 * plain[:20, :20].mean()  # far from the disc it is dim
    piped(monkeypatch, "step 30", "show why", "show why not stale_perception x.png")
    done = visup("step", clip)
    assert "show why WHAT" in done.out
    assert done.code == 2
