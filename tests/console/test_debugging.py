"""Breakpoints and phases agree with the steps of the run."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.archive.recordings import meeting, record
from tests.console.test_runs import SETTINGS
from visup.agent.contract.phases import Phase
from visup.agent.model.errors import VisupError
from visup.agent.model.step import Step
from visup.console.reasoning import debugging
from visup.console.reasoning.inquiry import Inquiry


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Inquiry, Sequence[Step]]:
    folder = tmp_path_factory.mktemp("runs") / "one"
    steps = record(folder, meeting(), SETTINGS)
    return Inquiry(folder), steps


@pytest.mark.parametrize("kind", ["alert", "identified", "stage_done", "entry"])
def test_a_breakpoint_stops_at_the_next_step_with_its_event(
    run: tuple[Inquiry, Sequence[Step]], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    inquiry, steps = run
    monkeypatch.setattr(debugging, "CHUNK_STEPS", 7)
    wanted = [n for n, s in enumerate(steps, 1) if any(e.kind == kind for e in s.events)]
    found, number = [], 0
    while (stop := inquiry.next_stop(number, [f"event {kind}"])).reasons:
        number = stop.number
        found.append(number)
        inquiry.mind(3)  # others ask in between
    assert stop.ended
    assert found == wanted


def test_the_first_condition_met_stops_the_search(run: tuple[Inquiry, Sequence[Step]]) -> None:
    inquiry, _ = run
    stop = inquiry.next_stop(0, ["time 3", "frame 20", "when gap(1, 2) < 1 px"])
    assert stop.number == 21
    assert stop.reasons == ("frame 20",)


@pytest.mark.parametrize(
    "words", [[], [" "], ["phase match"], ["nonsense"], ["when gap(1"], ["time 1"] * 21]
)
def test_invalid_breakpoints_are_refused(
    run: tuple[Inquiry, Sequence[Step]], words: list[str]
) -> None:
    with pytest.raises(VisupError):
        run[0].next_stop(5, words)


def test_a_cancelled_search_ends(run: tuple[Inquiry, Sequence[Step]]) -> None:
    found = run[0].next_stop(0, ["time 1e9"], lambda: True)
    assert (found.number, found.reasons, found.ended) == (0, (), False)


def test_the_phases_of_a_step_have_all_its_events(
    run: tuple[Inquiry, Sequence[Step]],
) -> None:
    inquiry, steps = run
    for number in (1, 2, 12, 40, 47, 60):
        records = inquiry.phases(number)
        assert [r.phase for r in records] == list(Phase)
        texts = [text for r in records for text in r.events]
        assert sorted(texts) == sorted(e.text for e in steps[number - 1].events)
        percepts = records[0].percepts
        assert percepts["region"] == (3 if number <= 45 else 2)
    first = inquiry.phases(1)
    assert any(c.about == "object" for c in first[1].changes)
    with pytest.raises(VisupError):
        inquiry.phases(61)
