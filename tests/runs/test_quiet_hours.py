"""In quiet hours only what is critical is told; the rest once they are over, if it still holds."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Alert, Mind, Observation, Severity
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.runs.unattended.quiet_hours import QuietGate, QuietHours, quiet_period

NIGHT = QuietHours.read(["22:00-06:00"], "UTC")


@pytest.mark.parametrize(
    ("text", "quiet", "loud"),
    [
        ("22:00-06:00", ["Mon 22:00", "Tue 05:59", "Sun 23:59"], ["Mon 21:59", "Mon 06:00"]),
        ("Sat-Sun 00:00-24:00", ["Sat 00:00", "Sun 23:59"], ["Fri 23:59", "Mon 00:00"]),
        ("Fri 22:00-06:00", ["Fri 22:00", "Sat 05:59"], ["Sat 22:00", "Fri 05:00"]),
        ("Sat-Mon 12:00-13:00", ["Sun 12:30", "Mon 12:59"], ["Tue 12:30", "Mon 13:00"]),
        ("08:00-08:00", ["Mon 08:00", "Tue 07:59"], []),
    ],
)
def test_a_quiet_period_covers_its_times(text: str, quiet: list[str], loud: list[str]) -> None:
    hours = QuietHours.read([text], "UTC")
    assert [t for t in quiet if not hours.hold(wall(t))] == []
    assert [t for t in loud if hours.hold(wall(t))] == []


def wall(text: str) -> float:
    day, _, clock = text.partition(" ")
    number = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun").index(day)
    hour, minute = map(int, clock.split(":"))
    return datetime(2026, 11, 23 + number, hour, minute, tzinfo=UTC).timestamp()


@pytest.mark.parametrize(
    "text",
    ["", "22-6", "25:00-06:00", "22:00-24:30", "10:60-11:00", "Mo 10:00-11:00", "22:00-00:00x"],
)
def test_an_invalid_period_is_refused(text: str) -> None:
    with pytest.raises(SettingsError, match="quiet hours"):
        quiet_period(text)


def test_quiet_hours_follow_the_time_zone() -> None:
    hours = QuietHours.read(["22:00-06:00"], "Europe/Berlin")
    assert hours.hold(wall("Mon 21:30"))
    assert not hours.hold(wall("Mon 05:30"))
    with pytest.raises(SettingsError, match="time zone"):
        QuietHours.read([], "Mars/Olympus")


def alert(number: int, severity: Severity, opened: float) -> Alert:
    return Alert(number, "seen", severity, opened, opened, (), "Seen.")


def step(time: float, still: list[Alert], *changed: Alert) -> Step:
    seen = Observation(0, time, (8, 8), ())
    return Step(0, time, seen, Mind(time=time, alerts=tuple(still)), alerts=changed)


LIVES = st.lists(
    st.tuples(st.floats(0, 40), st.floats(0.1, 30), st.sampled_from(Severity)), max_size=8
)
HOUR = 3600.0


@given(LIVES, st.none() | st.floats(1, 60))
def test_open_alerts_are_sent_once_after_quiet_hours(
    lives: list[tuple[float, float, Severity]], killed_at: float | None
) -> None:
    """Hours of two days, one step each; the process may be killed once between two steps."""
    base = wall("Mon 12:00")
    alerts = [
        (alert(i, severity, round(begin) * HOUR), round(begin), round(begin + length) + 1)
        for i, (begin, length, severity) in enumerate(lives)
    ]
    told: list[tuple[int, str, int]] = []
    gate = QuietGate(NIGHT, lambda time: base + time)
    for hour in range(75):
        if killed_at is not None and hour == round(killed_at):
            last = base + (hour - 1) * HOUR
            gate = QuietGate(NIGHT, lambda time: base + time, last)
        opened = [a for a, begin, _ in alerts if begin == hour]
        closed = [replace(a, closed=hour * HOUR) for a, _, end in alerts if end == hour]
        still = [a for a, begin, end in alerts if begin <= hour < end]
        due = gate(step(hour * HOUR, still, *opened, *closed))
        told += [(a.id, "closed" if a.closed is not None else "opened", hour) for a in due]
    assert len({t[:2] for t in told}) == len(told)
    by_id = {(number, state): hour for number, state, hour in told}
    for a, begin, end in alerts:
        loud = next((h for h in range(begin, end) if not NIGHT.hold(base + h * HOUR)), None)
        expected = begin if a.severity is Severity.CRITICAL else loud
        assert by_id.get((a.id, "opened")) == expected
        assert by_id.get((a.id, "closed")) == (None if expected is None else end)


def test_an_alert_that_becomes_critical_is_sent_at_once() -> None:
    base = wall("Mon 23:00")
    gate = QuietGate(NIGHT, lambda time: base + time)
    grave = alert(1, Severity.WARNING, 0.0)
    assert gate(step(0.0, [grave], grave)) == ()
    worse = replace(grave, severity=Severity.CRITICAL)
    assert gate(step(1.0, [worse])) == (worse,)
    assert gate(step(2.0, [worse])) == ()
