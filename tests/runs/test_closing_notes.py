"""What a run says in the end of tasks of which nothing was seen."""

import pytest

from visup.agent import Mind, Verdict
from visup.agent.model.task_beliefs import Binding, TaskBelief
from visup.runs.wiring import closing_notes

FOUND, MISSING = Binding("arm", (), 1, 1.0), Binding("tray", ())


@pytest.mark.parametrize(
    ("verdict", "bindings", "named"),
    [
        (Verdict.UNKNOWN, (FOUND, MISSING), ["the tray"]),
        (Verdict.UNKNOWN, (MISSING, Binding("part", ())), ["the tray", "the part"]),
        (Verdict.UNKNOWN, (FOUND,), []),
        (Verdict.IN_PROGRESS, (FOUND, MISSING), []),
        (Verdict.SUCCEEDED, (MISSING,), []),
    ],
)
def test_missing_actors_of_a_task_are_named_at_the_end(
    verdict: Verdict, bindings: tuple[Binding, ...], named: list[str]
) -> None:
    mind = Mind(tasks=(TaskBelief("serve", verdict, bindings=bindings),))
    notes = closing_notes(mind, "unknown")
    assert len(notes) == bool(named)
    assert all(f"{name}" in notes[0] and "'serve'" in notes[0] for name in named)
