"""How much confidences are worth: what is calibrated has no error, and the truth is that of the file."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.archive.recordings import meeting, record
from tests.cli import Call, caller
from tests.paths import ROOT
from visup.agent.model.errors import SettingsError, SourceError
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.commands.watch import watch_settings
from visup.evaluation.archive.calibrating import read_truth, reliability
from visup.evaluation.archive.vote_fitting import LabelledVotes, fitted_evidence
from visup.rules.identity import VoteSettings
from visup.runs.inputs.settings_file import fitted_settings
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent

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


def figures_of(page: Path) -> list[dict[str, Any]]:
    (held,) = re.findall(
        r'id="figures">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL
    )
    found: list[dict[str, Any]] = json.loads(held)
    return found


def drawn_votes(evidence: float, count: int) -> list[LabelledVotes]:
    """Objects that are what their votes say, as often as votes that tell so much say."""
    rng, found = np.random.default_rng(5), []
    for votes in rng.uniform(0, 3, (count, 3)):
        named = {"arm": float(votes[0]), "cup": float(votes[1])}
        of = LabelledVotes(named, float(votes[2]), "")
        names = ("arm", "cup", "unknown object")
        likely = [replace(of, truth=name).likelihood(evidence) for name in names]
        assert sum(likely) == pytest.approx(1.0)
        found.append(replace(of, truth=str(rng.choice(names, p=likely))))
    return found


@pytest.mark.parametrize("evidence", [0.7, 1.4, 3.0])
def test_what_votes_tell_is_found_again(evidence: float) -> None:
    assert fitted_evidence(drawn_votes(evidence, 600)) == pytest.approx(evidence, rel=0.15)


def test_few_labels_change_little_and_fewer_nothing() -> None:
    assert fitted_evidence(drawn_votes(2.2, 9)) is None
    few = fitted_evidence([LabelledVotes({"arm": 2.0}, 1.0, "arm")] * 10)
    assert few is not None
    assert VoteSettings().evidence < few < 2 * VoteSettings().evidence


def test_what_was_fitted_is_read_by_watch(tmp_path: Path) -> None:
    path = tmp_path / "fit.toml"
    path.write_text(fitted_settings(0.8, "Fitted.") + "[behaviours.lamp]\ncontrast = 4\n")
    read = watch_settings("clip.mp4", {}, path)
    assert (read.vote_evidence, read.plugin_settings) == (0.8, {"lamp": {"contrast": 4}})
    sure = []
    for settings in (WatchSettings("clip.mp4"), replace(read, plugin_settings={})):
        agent = reasoning_agent(settings)
        for seen in meeting(20):
            agent.reason(seen)
        sure.append(agent.mind.objects[2].confidence)
    assert sure[1] < sure[0]


def test_the_settings_of_the_page_are_some(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "s.toml").write_text(text)
    assert watch_settings("clip.mp4", {}, tmp_path / "s.toml").vote_evidence == 1.874


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("identity = 3", "`identity` holds something unknown"),
        ("[identity]\nevidense = 3", "`identity` holds something unknown"),
        ("[identity]\nevidence = true", "`evidence` is True"),
        ("[identity]\nevidence = 0", "`evidence` of identities is 0"),
        ("[identity]\nevidence = nan", "`evidence` of identities is nan"),
        ("[identities]\nevidence = 1", "'identities' is unknown"),
    ],
)
def test_a_settings_file_with_a_fault_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(SettingsError) as told:
        watch_settings("clip.mp4", {}, tmp_path / "s.toml")
    assert said in str(told.value)


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
    assert "Statements about identity: 2, of which 50% right" in visup(*words).out
    page, fit = tmp_path / "page.html", tmp_path / "fit.toml"
    told = visup(*words, "--page", page, "--fit", fit)
    assert "2 objects are labelled; fitting the weight of votes takes at least 10" in told.out
    assert not fit.exists()
    drawn = {f["id"]: f for f in figures_of(page)}
    assert set(drawn) == {"reliability-identity", "reliability-verdict"}
    assert drawn["reliability-verdict"]["data"][1]["y"] == [1.0]
    truth.write_text("source\nother.mp4\n")
    assert visup(*words).code == 2
