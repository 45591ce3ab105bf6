"""The parts of `visup eval archive` measure what they say, on the smallest that there is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from visup.agent.model.errors import SettingsError
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.archive.querying.database import open_database
from visup.evaluation.archive.exactness import compare_find
from visup.evaluation.archive.large_lake import QUESTIONS
from visup.evaluation.archive.multiplied import lend_recordings, multiply
from visup.evaluation.archive.runner import evaluate_archive
from visup.evaluation.figures import silent
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    place = tmp_path_factory.mktemp("small")
    lake = Lake.create(place / "lake")
    for number, count in enumerate((30, 14)):
        record(place / f"run-{number}", meeting(count, 20), DOCK)
        add_run(lake, place / f"run-{number}")
    return lake


def test_a_lake_is_multiplied(small: Lake, tmp_path: Path) -> None:
    large, rows = multiply(small, tmp_path / "large", 9, 2_000, 1, silent)
    assert len(large.runs()) == len({*large.runs()}) == 9
    with open_database(large) as database:
        counted = {
            name: database.ask(f"SELECT count(*) AS n FROM lake.{name}").to_pylist()[0]["n"]
            for name in ("relations", "events", "runs")
        }
        assert counted["relations"] + counted["events"] == rows
        assert 0.5 < rows / 2_000 < 2
        assert counted["runs"] == 9
        for sql in QUESTIONS.values():
            database.ask(sql)
        (backward,) = database.ask(
            'SELECT count(*) AS n FROM lake.relations WHERE "end" < "begin"'
        ).to_pylist()
        assert backward["n"] == 0
    lend_recordings(small, large, large.runs())
    assert large.recorded(large.runs()[0])[1].tasks


def test_what_is_found_is_compared_with_replays(small: Lake, tmp_path: Path) -> None:
    found = compare_find(small, 3, 1, tmp_path, silent)
    assert found["different"] == 0
    assert found["verdicts"] > 100


def test_a_part_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="there is no part 'sleep'"):
        evaluate_archive(tmp_path, part=["sleep"])
