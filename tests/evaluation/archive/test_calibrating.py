"""How much confidences are worth: what is calibrated has no error, and the truth is that of the file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.archive.recordings import meeting, record
from tests.cli import Call, caller
from visup.agent.model.errors import SourceError
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.evaluation.archive.calibrating import read_truth, reliability
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=60))
def test_bins_hold_all_that_was_said(said: list[tuple[float, bool]]) -> None:
    found = reliability("stage", said)
    assert sum(b["count"] for b in found.bins) == found.count == len(said)
    assert 0 <= found.error <= 1
    assert found.error**2 <= found.brier + 1e-12  # Jensen: binning only loses
    assert found.right == pytest.approx(sum(r for _, r in said) / len(said))


def test_what_is_calibrated_has_no_error_and_what_is_too_sure_has() -> None:
    rng = np.random.default_rng(1)
    sure = rng.random(20_000)
    right = rng.random(20_000) < sure
    assert reliability("identity", list(zip(sure, right, strict=True))).error < 0.02
    boasting = list(zip(np.ones(20_000), right, strict=True))
    assert reliability("identity", boasting).error == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("verdict\nfailed\n", "expected: source, and some of"),
        ("source,colour\na,red\n", "expected: source, and some of"),
        ("source,objects\na,spartan\n", "'spartan' says nothing"),
    ],
)
def test_what_is_no_truth_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(SourceError) as told:
        read_truth(tmp_path / "t.csv")
    assert said in str(told.value)
    with pytest.raises(SourceError, match="cannot be read"):
        read_truth(tmp_path / "none.csv")


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    lake = Lake.create(tmp_path / "lake")
    record(tmp_path / "run", meeting(40, 20), DOCK)
    add_run(lake, tmp_path / "run")
    (row,) = lake.rows("runs")
    objects = {o["object"]: o for o in lake.rows("objects") if o["confirmed"]}
    truth = tmp_path / "truth.csv"
    truth.write_text(f"source,verdict,objects\nclip.mp4,{row['verdict']},1=arm;2=guitar;99=arm\n")
    words = ("archive", "calibrate", lake.path, "--truth", truth)
    by_kind = {one["kind"]: one for one in json.loads(visup(*words, "--json").out)}
    assert set(by_kind) == {"identity", "verdict"}  # of stages nothing is known
    assert by_kind["identity"]["count"] == 2
    assert by_kind["identity"]["right"] == 0.5
    squares = (1 - objects[1]["confidence"]) ** 2 + objects[2]["confidence"] ** 2
    assert by_kind["identity"]["brier"] == pytest.approx(squares / 2)
    assert by_kind["verdict"]["right"] == 1.0
    assert "identity: 2 said, 50% right" in visup(*words).out
    truth.write_text("source\nother.mp4\n")
    assert visup(*words).code == 2
