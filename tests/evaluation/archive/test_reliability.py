"""Reliability of confidences: calibration error, the truth file, and the fitted weight of votes."""

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
from visup.evaluation.archive.reliability import read_truth, reliability
from visup.evaluation.archive.vote_fitting import LabelledVotes, fitted_evidence
from visup.rules.identity import VoteSettings
from visup.runs.inputs.settings_file import fitted_settings
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@given(st.lists(st.tuples(st.floats(0, 1), st.booleans()), min_size=1, max_size=60))
def test_every_statement_is_in_one_bin(statements: list[tuple[float, bool]]) -> None:
    result = reliability("stage", statements)
    assert sum(b["count"] for b in result.bins) == result.count == len(statements)
    assert 0 <= result.error <= 1
    assert result.error**2 <= result.brier + 1e-12  # Jensen: binning only loses
    assert result.right == pytest.approx(
        sum(correct for _, correct in statements) / len(statements)
    )


def test_calibrated_confidences_have_no_error_and_overconfident_ones_have() -> None:
    rng = np.random.default_rng(1)
    confidences = rng.random(20_000)
    correct = rng.random(20_000) < confidences
    assert reliability("identity", list(zip(confidences, correct, strict=True))).error < 0.02
    overconfident = list(zip(np.ones(20_000), correct, strict=True))
    assert reliability("identity", overconfident).error == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("verdict\nfailed\n", "expected: source, and some of"),
        ("source,colour\na,red\n", "expected: source, and some of"),
        ("source,objects\na,spartan\n", "'spartan' says nothing"),
    ],
)
def test_a_malformed_truth_file_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(SourceError) as caught:
        read_truth(tmp_path / "t.csv")
    assert expected in str(caught.value)
    with pytest.raises(SourceError, match="cannot be read"):
        read_truth(tmp_path / "none.csv")


def figures_of(page: Path) -> list[dict[str, Any]]:
    (json_text,) = re.findall(
        r'id="figures">(.*?)</script>', page.read_text(encoding="utf-8"), re.DOTALL
    )
    figures: list[dict[str, Any]] = json.loads(json_text)
    return figures


def sampled_votes(evidence: float, count: int) -> list[LabelledVotes]:
    """Objects whose true identity is drawn from the softmax over their votes with a given weight."""
    rng, labelled = np.random.default_rng(5), []
    for votes in rng.uniform(0, 3, (count, 3)):
        votes_by_name = {"arm": float(votes[0]), "cup": float(votes[1])}
        unlabelled = LabelledVotes(votes_by_name, float(votes[2]), "")
        names = ("arm", "cup", "unknown object")
        probabilities = [replace(unlabelled, truth=name).likelihood(evidence) for name in names]
        assert sum(probabilities) == pytest.approx(1.0)
        labelled.append(replace(unlabelled, truth=str(rng.choice(names, p=probabilities))))
    return labelled


@pytest.mark.parametrize("evidence", [0.7, 1.4, 3.0])
def test_the_weight_of_votes_is_recovered(evidence: float) -> None:
    assert fitted_evidence(sampled_votes(evidence, 600)) == pytest.approx(evidence, rel=0.15)


def test_few_labels_change_the_weight_little_and_too_few_not_at_all() -> None:
    assert fitted_evidence(sampled_votes(2.2, 9)) is None
    few = fitted_evidence([LabelledVotes({"arm": 2.0}, 1.0, "arm")] * 10)
    assert few is not None
    assert VoteSettings().evidence < few < 2 * VoteSettings().evidence


def test_watch_reads_fitted_settings(tmp_path: Path) -> None:
    path = tmp_path / "fit.toml"
    path.write_text(fitted_settings(0.8, "Fitted.") + "[behaviours.lamp]\ncontrast = 4\n")
    loaded = watch_settings("clip.mp4", {}, path)
    assert (loaded.vote_evidence, loaded.plugin_settings) == (0.8, {"lamp": {"contrast": 4}})
    confidences = []
    for settings in (WatchSettings("clip.mp4"), replace(loaded, plugin_settings={})):
        agent = reasoning_agent(settings)
        for observation in meeting(20):
            agent.reason(observation)
        confidences.append(agent.mind.objects[2].confidence)
    assert confidences[1] < confidences[0]


def test_the_settings_in_the_documentation_are_valid(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    (tmp_path / "s.toml").write_text(text)
    assert watch_settings("clip.mp4", {}, tmp_path / "s.toml").vote_evidence == 1.874


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("identity = 3", "`identity` holds something unknown"),
        ("[identity]\nevidense = 3", "`identity` holds something unknown"),
        ("[identity]\nevidence = true", "`evidence` is True"),
        ("[identity]\nevidence = 0", "`evidence` of identities is 0"),
        ("[identity]\nevidence = nan", "`evidence` of identities is nan"),
        ("[identities]\nevidence = 1", "'identities' is unknown"),
    ],
)
def test_an_invalid_settings_file_is_refused(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(SettingsError) as caught:
        watch_settings("clip.mp4", {}, tmp_path / "s.toml")
    assert expected in str(caught.value)


def test_the_command_prints_figures_and_writes_a_page(
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
    arguments = ("archive", "calibrate", lake.path, "--truth", truth)
    by_kind = {one["kind"]: one for one in json.loads(visup(*arguments, "--json").out)}
    assert set(by_kind) == {"identity", "verdict"}  # of stages nothing is known
    assert by_kind["identity"]["count"] == 2
    assert by_kind["identity"]["right"] == 0.5
    squares = (1 - objects[1]["confidence"]) ** 2 + objects[2]["confidence"] ** 2
    assert by_kind["identity"]["brier"] == pytest.approx(squares / 2)
    assert by_kind["verdict"]["right"] == 1.0
    assert "Statements about identity: 2, of which 50% right" in visup(*arguments).out
    page, fit = tmp_path / "page.html", tmp_path / "fit.toml"
    printed = visup(*arguments, "--page", page, "--fit", fit)
    assert "2 objects are labelled; fitting the weight of votes takes at least 10" in printed.out
    assert not fit.exists()
    diagrams = {f["id"]: f for f in figures_of(page)}
    assert set(diagrams) == {"reliability-identity", "reliability-verdict"}
    assert diagrams["reliability-verdict"]["data"][1]["y"] == [1.0]
    truth.write_text("source\nother.mp4\n")
    assert visup(*arguments).code == 2
