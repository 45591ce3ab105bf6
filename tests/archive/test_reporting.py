"""The page about all runs: durations are those of the tables, drifts are not due to chance."""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np
import pytest

from tests.archive.recordings import meeting, record
from tests.cli import Call, caller
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.archive.querying.database import LakeDatabase, open_database
from visup.archive.reporting.figures import all_figures
from visup.archive.reporting.page import lake_page
from visup.archive.reporting.statistics import LakeStatistics, drifts, lake_statistics
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("plotly", reason="needs the extra `report`")
arrow = pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})
ACTIVE_STATUSES = ("active", "progressing", "paused", "stalled")


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """Runs of which some fail."""
    folder = tmp_path_factory.mktemp("report")
    lake = Lake.create(folder / "lake <b>")
    for number, count in enumerate((45, 25, 14)):
        record(folder / f"run-{number}", meeting(count, 20), DOCK)
        add_run(lake, folder / f"run-{number}", {"gripper": "<new>" if number else "old"})
    return lake


@pytest.fixture(scope="module")
def statistics(lake: Lake) -> Iterator[LakeStatistics]:
    with open_database(lake) as database:
        yield lake_statistics(database)


def test_durations_are_those_of_the_tables(lake: Lake, statistics: LakeStatistics) -> None:
    durations: dict[tuple[str, str], dict[str, float]] = defaultdict(lambda: defaultdict(float))
    for row in lake.rows("stages"):
        if row["status"] in ACTIVE_STATUSES:
            durations[row["task"], row["stage"]][row["run"]] += row["end"] - row["begin"]
    assert {(d.task, d.stage): d.runs for d in statistics.durations} == {
        s: len(of) for s, of in durations.items()
    }
    medians = [median(durations[d.task, d.stage].values()) for d in statistics.durations]
    assert [d.mid for d in statistics.durations] == pytest.approx(medians)
    for stage in statistics.durations:
        parts = [d for d in statistics.by_actor if (d.task, d.stage) == (stage.task, stage.stage)]
        of_label = [d for d in parts if d.group.startswith("gripper = ")]
        assert sum(d.runs for d in of_label) == stage.runs
        (played,) = [d for d in parts if d.group == "satellite = spartan"]
        assert (played.runs, played.mid) == (stage.runs, stage.mid)
        assert played.low <= played.mid <= played.high <= played.longest


def test_failures_are_complete_and_ranked(lake: Lake, statistics: LakeStatistics) -> None:
    failed = [r for r in lake.rows("runs") if r["verdict"] in ("failed", "interrupted")]
    assert sum(f.runs for f in statistics.failures) == len(failed) > 0
    assert sum(f.share for f in statistics.failures) == pytest.approx(1.0)
    assert [f.runs for f in statistics.failures] == sorted(
        (f.runs for f in statistics.failures), reverse=True
    )
    assert {f.run for f in statistics.failures} <= {r["run"] for r in failed}


class _Answers:
    """A database that gives the same answer to every question."""

    def __init__(self, took: np.ndarray) -> None:
        self.took = took

    def ask(self, sql: str) -> object:
        """The durations, a run a day."""
        count = len(self.took)
        names = {"task": ["t"] * count, "stage": ["s"] * count}
        return arrow.table({**names, "at": np.arange(count) * 86400.0, "took": self.took})


def drifting(took: np.ndarray) -> list[float]:
    database: LakeDatabase = _Answers(took)  # type: ignore[assignment]
    return [d.change for d in drifts(database)]


def test_drifts_are_reported_and_noise_is_not() -> None:
    rng = np.random.default_rng(3)
    false = sum(bool(drifting(rng.lognormal(2.0, 0.5, 60))) for _ in range(100))
    assert false <= 4  # one in a hundred is expected
    base = 10.0 + rng.normal(0, 1, 80)
    assert drifting(base) == drifting(base[:5] + np.arange(5)) == drifting(np.full(80, 3.0)) == []
    (slower,) = drifting(base + np.linspace(0, 6, 80))
    (faster,) = drifting((base + np.linspace(0, 6, 80))[::-1])
    assert 0.3 < slower < 0.6
    assert faster == pytest.approx(1 / (1 + slower) - 1)


def test_the_page_is_complete_and_escaped(lake: Lake, statistics: LakeStatistics) -> None:
    page = lake_page(statistics, lake.path)
    assert page == lake_page(statistics, lake.path)
    assert "lake &lt;b&gt;" in page
    assert "gripper = &lt;new&gt;" in page
    assert "<b>" not in page
    (text,) = re.findall(r'id="figures">(.*?)</script>', page)
    ids = [figure["id"] for figure in json.loads(text)]
    assert ids == [figure.key for figure in all_figures(statistics)]
    assert all(f'id="{key}"' in page for key in ids)


def test_the_command_writes_the_page(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    out = tmp_path / "all.html"
    assert visup("archive", "report", lake.path, "--out", out).code == 0
    assert "<h2>How runs fail</h2>" in out.read_text()
    empty = Lake.create(tmp_path / "empty").path
    result = visup("archive", "report", empty)
    assert (result.code, result.out) == (0, f"{empty}/report.html: 0 runs\n")
    assert "No run failed." in (empty / "report.html").read_text()
    assert visup("archive", "report", tmp_path / "none").code == 2
