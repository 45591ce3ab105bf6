"""What people say of alerts is kept, and becomes precision figures."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, Severity
from visup.agent.model.errors import VisupError
from visup.console.feedback import (
    FEEDBACK,
    LONGEST_NOTE,
    AlertFeedback,
    Opinion,
    precisions,
    read_feedback,
    say,
)


def alert(number: int, kind: str = "collision_course") -> Alert:
    return Alert(number, kind, Severity.WARNING, 1.0, 1.0, (1, 2), "They come near.")


def test_the_last_word_counts_and_all_are_kept(tmp_path: Path) -> None:
    say(tmp_path, alert(1), Opinion.RIGHT)
    say(tmp_path, alert(2), Opinion.MUTED, "the door\n is open")
    say(tmp_path, alert(1), Opinion.FALSE_ALARM, "a shadow")
    said = read_feedback(tmp_path)
    assert {n: (f.opinion, f.note) for n, f in said.items()} == {
        1: (Opinion.FALSE_ALARM, "a shadow"),
        2: (Opinion.MUTED, "the door is open"),
    }
    assert len((tmp_path / FEEDBACK).read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("opinion", "note"), [(Opinion.MUTED, " "), (Opinion.SEEN, "x" * (LONGEST_NOTE + 1))]
)
def test_what_cannot_be_kept_is_refused(tmp_path: Path, opinion: Opinion, note: str) -> None:
    with pytest.raises(VisupError):
        say(tmp_path, alert(1), opinion, note)
    assert not (tmp_path / FEEDBACK).exists()


def test_lines_that_cannot_be_read_hide_no_others(tmp_path: Path) -> None:
    say(tmp_path, alert(1), Opinion.SEEN)
    with (tmp_path / FEEDBACK).open("a") as out:
        out.write('nonsense\n{"alert": 3}\n[]\n{"alert": "x", "kind": "k", "opinion": "loud"}\n')
    say(tmp_path, alert(2), Opinion.RIGHT)
    assert sorted(read_feedback(tmp_path)) == [1, 2]


OPINIONS = st.lists(st.tuples(st.sampled_from("ab"), st.none() | st.sampled_from(list(Opinion))))


@given(OPINIONS)
def test_precision_is_the_share_of_right_ones_among_the_judged(
    said: list[tuple[str, Opinion | None]],
) -> None:
    alerts = [alert(n, kind) for n, (kind, _) in enumerate(said)]
    feedback = {
        n: AlertFeedback(n, kind, opinion) for n, (kind, opinion) in enumerate(said) if opinion
    }
    for found in precisions([(alerts, feedback)]):
        of_kind = [o for kind, o in said if kind == found.kind]
        judged = [o for o in of_kind if o in (Opinion.RIGHT, Opinion.FALSE_ALARM)]
        assert found.alerts == len(of_kind)
        expected = judged.count(Opinion.RIGHT) / len(judged) if judged else None
        assert found.precision == expected
