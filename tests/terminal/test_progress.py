"""The progress bar: how much is done, how fast, how much longer, how far behind."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from visup.commands.watch import MIN_SHOWN_LAG_S, pace_text, progress_bar


@pytest.mark.parametrize(
    ("done", "took_s", "lag_s", "told"),
    [
        (50, 2.0, None, "25.0 frames/s"),
        (50, 2.0, MIN_SHOWN_LAG_S / 2, "25.0 frames/s"),
        (50, 2.0, 12.34, "25.0 frames/s, 12.3 s behind"),
        (1, 0.5, None, ""),  # too early to tell
    ],
)
def test_pace_and_lag_are_printed(done: int, took_s: float, lag_s: float | None, told: str) -> None:
    assert pace_text(done, took_s, lag_s) == told


@pytest.mark.parametrize(("terminal", "shown"), [(True, True), (False, True), (True, False)])
def test_a_terminal_shows_progress_and_remaining_time(terminal: bool, shown: bool) -> None:
    out = StringIO()
    console = Console(file=out, force_terminal=terminal, width=100)
    with progress_bar(console, "watching", shown=shown) as tell:
        tell(50, 100, 12.34)
    expected = ("watching", "50/100", "12.3 s behind", "-:--:--")  # no rate yet, so no time to go
    assert [word in out.getvalue() for word in expected] == [terminal and shown] * len(expected)
