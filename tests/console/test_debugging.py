"""Breakpoints and phases as pages ask for them: the same steps that the run made."""

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
def test_each_stop_is_the_next_step_that_tells_it(
    run: tuple[Inquiry, Sequence[Step]], kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, steps = run
    monkeypatch.setattr(debugging, "CHUNK", 7)
    wanted = [n for n, s in enumerate(steps, 1) if any(e.kind == kind for e in s.events)]
    found, at = [], 0
    while (stop := asked.next_stop(at, [f"event {kind}"])).reasons:
        at = stop.number
        found.append(at)
        asked.mind(3)  # others ask in between
    assert stop.ended
    assert found == wanted


def test_of_several_conditions_the_first_one_ends_it(run: tuple[Inquiry, Sequence[Step]]) -> None:
    asked, _ = run
    both = asked.next_stop(0, ["time 3", "frame 20", "when gap(1, 2) < 1 px"])
    assert both.number == 21
    assert both.reasons == ("frame 20",)


@pytest.mark.parametrize(
    "words", [[], [" "], ["phase match"], ["nonsense"], ["when gap(1"], ["time 1"] * 21]
)
def test_what_cannot_be_a_breakpoint_is_refused(
    run: tuple[Inquiry, Sequence[Step]], words: list[str]
) -> None:
    with pytest.raises(VisupError):
        run[0].next_stop(5, words)


def test_a_search_that_nobody_waits_for_is_given_up(run: tuple[Inquiry, Sequence[Step]]) -> None:
    found = run[0].next_stop(0, ["time 1e9"], lambda: True)
    assert (found.number, found.reasons, found.ended) == (0, (), False)


def test_the_phases_of_a_step_tell_together_what_it_told(
    run: tuple[Inquiry, Sequence[Step]],
) -> None:
    asked, steps = run
    for number in (1, 2, 12, 40, 47, 60):
        records = asked.phases(number)
        assert [r.phase for r in records] == list(Phase)
        told = [text for r in records for text in r.events]
        assert sorted(told) == sorted(e.text for e in steps[number - 1].events)
        seen = records[0].percepts
        assert seen["region"] == (3 if number <= 45 else 2)
    first = asked.phases(1)
    assert any(c.about == "object" for c in first[1].changes)
    with pytest.raises(VisupError):
        asked.phases(61)
