"""Feedback on alerts is stored, and gives precision figures."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, Severity
from visup.agent.model.errors import VisupError
from visup.console.feedback import (
    FEEDBACK,
    MAX_NOTE_LENGTH,
    AlertFeedback,
    Opinion,
    precisions,
    read_feedback,
    store_feedback,
)


def alert(number: int, kind: str = "collision_course") -> Alert:
    return Alert(number, kind, Severity.WARNING, 1.0, 1.0, (1, 2), "They come near.")


def test_the_last_feedback_counts_and_earlier_ones_are_kept(tmp_path: Path) -> None:
    store_feedback(tmp_path, alert(1), Opinion.RIGHT)
    store_feedback(tmp_path, alert(2), Opinion.MUTED, "the door\n is open")
    store_feedback(tmp_path, alert(1), Opinion.FALSE_ALARM, "a shadow")
    opinions = read_feedback(tmp_path)
    assert {n: (f.opinion, f.note) for n, f in opinions.items()} == {
        1: (Opinion.FALSE_ALARM, "a shadow"),
        2: (Opinion.MUTED, "the door is open"),
    }
    assert len((tmp_path / FEEDBACK).read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("opinion", "note"), [(Opinion.MUTED, " "), (Opinion.SEEN, "x" * (MAX_NOTE_LENGTH + 1))]
)
def test_invalid_feedback_is_refused(tmp_path: Path, opinion: Opinion, note: str) -> None:
    with pytest.raises(VisupError):
        store_feedback(tmp_path, alert(1), opinion, note)
    assert not (tmp_path / FEEDBACK).exists()


def test_invalid_lines_are_skipped(tmp_path: Path) -> None:
    store_feedback(tmp_path, alert(1), Opinion.SEEN)
    with (tmp_path / FEEDBACK).open("a") as out:
        out.write('nonsense\n{"alert": 3}\n[]\n{"alert": "x", "kind": "k", "opinion": "loud"}\n')
    store_feedback(tmp_path, alert(2), Opinion.RIGHT)
    assert sorted(read_feedback(tmp_path)) == [1, 2]


OPINIONS = st.lists(st.tuples(st.sampled_from("ab"), st.none() | st.sampled_from(list(Opinion))))


@given(OPINIONS)
def test_precision_is_the_share_of_right_alerts_among_the_rated(
    opinions: list[tuple[str, Opinion | None]],
) -> None:
    alerts = [alert(n, kind) for n, (kind, _) in enumerate(opinions)]
    feedback = {
        n: AlertFeedback(n, kind, opinion) for n, (kind, opinion) in enumerate(opinions) if opinion
    }
    for found in precisions([(alerts, feedback)]):
        of_kind = [o for kind, o in opinions if kind == found.kind]
        judged = [o for o in of_kind if o in (Opinion.RIGHT, Opinion.FALSE_ALARM)]
        assert found.alerts == len(of_kind)
        expected = judged.count(Opinion.RIGHT) / len(judged) if judged else None
        assert found.precision == expected
