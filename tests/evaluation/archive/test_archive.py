"""The parts of `visup eval archive`, on the smallest possible lake."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from visup.agent.model.errors import SettingsError
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.archive.querying.database import open_database
from visup.evaluation.archive.exactness import compare_find
from visup.evaluation.archive.large_lake import QUERIES
from visup.evaluation.archive.runner import evaluate_archive
from visup.evaluation.archive.synthetic_lake import link_recordings, multiply_lake
from visup.evaluation.figures import silent
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@pytest.fixture(scope="module")
def small_lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    folder = tmp_path_factory.mktemp("small")
    lake = Lake.create(folder / "lake")
    for number, count in enumerate((30, 14)):
        record(folder / f"run-{number}", meeting(count, 20), DOCK)
        add_run(lake, folder / f"run-{number}")
    return lake


def test_a_large_lake_has_the_requested_runs_and_rows(small_lake: Lake, tmp_path: Path) -> None:
    large, rows = multiply_lake(small_lake, tmp_path / "large", 9, 2_000, 1, silent)
    assert len(large.runs()) == len({*large.runs()}) == 9
    with open_database(large) as database:
        counts = {
            name: database.ask(f"SELECT count(*) AS n FROM lake.{name}").to_pylist()[0]["n"]
            for name in ("relations", "events", "runs")
        }
        assert counts["relations"] + counts["events"] == rows
        assert 0.5 < rows / 2_000 < 2
        assert counts["runs"] == 9
        for sql in QUERIES.values():
            database.ask(sql)
        (reversed_intervals,) = database.ask(
            'SELECT count(*) AS n FROM lake.relations WHERE "end" < "begin"'
        ).to_pylist()
        assert reversed_intervals["n"] == 0
    link_recordings(small_lake, large, large.runs())
    assert large.recorded(large.runs()[0])[1].tasks


def test_search_results_equal_replays(small_lake: Lake, tmp_path: Path) -> None:
    comparison = compare_find(small_lake, 3, 1, tmp_path, silent)
    assert comparison["different"] == 0
    assert comparison["verdicts"] > 100


def test_an_unknown_part_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="there is no part 'sleep'"):
        evaluate_archive(tmp_path, part=["sleep"])
