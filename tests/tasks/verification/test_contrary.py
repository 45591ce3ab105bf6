"""Since when a contrary counts: from the end of the action, unless it prevails over the action."""

from __future__ import annotations

import pytest

from visup.agent import Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.tasks.verification.observation import UNOBSERVED
from visup.tasks.verification.step_monitor import _note_contrary, entered


@pytest.mark.parametrize(
    ("onset", "decisive", "since"),
    [(3.0, False, 8.0), (9.0, False, 9.0), (3.0, True, 5.0), (7.0, True, 7.0)],
)
def test_a_contrary_counts_from_the_end_of_the_action_if_it_does_not_prevail(
    onset: float, decisive: bool, since: float
) -> None:
    """The step was entered at 5 s, and the action last held at 8 s."""
    monitor = replace(entered(5.0), held=True, held_at=8.0)
    apart = Relation("diverging", (1, 2), Truth.TRUE, onset)
    seen = replace(UNOBSERVED, observed=True, holds=Truth.FALSE, contrary=apart, decisive=decisive)
    noted = _note_contrary(monitor, seen, 9.0)
    assert noted.contrary_since == since
    assert noted.contrary_arose == (decisive and onset > 5.0)
