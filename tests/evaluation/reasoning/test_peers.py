"""Cases of other tools' tests: written in our language they come out as theirs."""

import json
from pathlib import Path
from typing import Any

import pytest

from tests.oracles.peers.runner import evaluate_peers
from tests.oracles.peers.temporal import outcome_of
from tests.paths import SHARED
from visup.agent.model.errors import SourceError

PEERS = SHARED / "peers"


def variable(name: str) -> dict[str, Any]:
    return {"op": "variable", "name": name}


def case(**fields: Any) -> dict[str, Any]:
    since = {"op": "since", "bounds": [0, "inf"], "args": [variable("f"), variable("g")]}
    return {
        "id": "made-1",
        "peer": "made",
        "formula": since,
        "text": "f since g",
        "time": "samples",
        "signals": {"f": [[0, 1], [1, -2], [2, 3]], "g": [[0, 4], [1, 5], [2, -1]]},
        "expected": [[0, 4], [1, 5], [2, 3]],
        "kind": "robustness",
        "semantics": ["past windows are cut at the first sample"],
        **fields,
    }


def test_each_outcome_is_recognised() -> None:
    assert outcome_of(case()) == "agree"
    assert outcome_of(case(expected=[[2, 2]])) == "differ"
    asked = ["since and until ask for both a and b at the moment of b", *case()["semantics"]]
    assert outcome_of(case(expected=[[0, 1], [1, -2], [2, -1]], semantics=asked)) == "agree"
    before = {"op": "historically", "bounds": [1, 2], "args": [variable("f")]}
    unknown = case(formula=before, expected=[[0, 0], [2, -2]], semantics=[])
    assert outcome_of(unknown) == "unknown_at_ends"
    empty = {"op": "always", "bounds": [2, 1], "args": [variable("f")]}
    assert outcome_of(case(formula=empty)) == "not_expressible"
    said = ["an empty window: always is true"]
    assert outcome_of(case(formula=empty, semantics=said)) == "other_semantics"


def test_windows_after_the_end_of_dense_time_have_the_last_value() -> None:
    later = {"op": "always", "bounds": [3, 4], "args": [variable("f")]}
    said = ["future windows are cut at the end of the signals"]
    dense = case(formula=later, time="dense-held", expected=[[0.5, 3], [1.5, 3]], semantics=said)
    assert outcome_of(dense) == "agree"


def test_a_folder_is_counted_by_peer_and_calculus(tmp_path: Path) -> None:
    (tmp_path / "temporal.json").write_text(json.dumps([case(), case(expected=[[2, 2]])]))
    found = evaluate_peers(tmp_path)
    assert found["total"] == {
        "cases": 2,
        "agree": 1,
        "unknown_at_ends": 0,
        "other_semantics": 0,
        "differ": 1,
        "not_expressible": 0,
    }
    assert [d["id"] for d in found["differing"]] == ["made-1"]
    with pytest.raises(SourceError, match="no cases"):
        evaluate_peers(tmp_path / "none")


@pytest.mark.skipif(not PEERS.is_dir(), reason="the shared cases of peers are not here")
def test_the_shared_cases_agree_as_documented() -> None:
    total = evaluate_peers(PEERS)["total"]
    assert total["differ"] == 0
    assert total["not_expressible"] < 0.01 * total["cases"]
    assert total["agree"] > 0.99 * total["cases"]
