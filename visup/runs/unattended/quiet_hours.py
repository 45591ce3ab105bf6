"""Quiet hours: alerts that are not critical are held until their end, and sent if still open.

An alert that opens and closes within quiet hours is in the journal with its evidence, but not sent to sinks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, tzinfo
from zoneinfo import ZoneInfo

from visup.agent import Alert, Severity
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step

_DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
_DAY = f"({'|'.join(_DAYS)})"
_PERIOD = re.compile(rf"(?:{_DAY}(?:-{_DAY})? )?(\d\d):(\d\d)-(\d\d):(\d\d)")
_WHOLE_DAY = 24 * 60
EXPECTED = "22:00-06:00, Sat 12:00-24:00, or Sat-Sun 00:00-24:00"


@dataclass(frozen=True, slots=True)
class QuietPeriod:
    """A period of the day on some weekdays.

    Attributes:
        days: Weekdays on which it begins, 0 is Monday.
        begin: Minutes after midnight.
        end: Minutes after midnight; at or before `begin` it ends on the next day.
    """

    days: frozenset[int]
    begin: int
    end: int

    def holds(self, day: int, minute: int) -> bool:
        """Whether a time is in the period.

        Args:
            day: Weekday, 0 is Monday.
            minute: Minutes after midnight.
        """
        if self.begin < self.end:
            return day in self.days and self.begin <= minute < self.end
        begun_today = day in self.days and minute >= self.begin
        return begun_today or ((day - 1) % 7 in self.days and minute < self.end)


def quiet_period(text: str) -> QuietPeriod:
    """Parse a period of a site file.

    >>> quiet_period("Sat-Mon 22:00-06:30").days == {5, 6, 0}
    True

    Raises:
        SettingsError: It is malformed.
    """
    match = _PERIOD.fullmatch(text.strip())
    begin, end = (
        (int(match[3]) * 60 + int(match[4]), int(match[5]) * 60 + int(match[6]))
        if match
        else (-1, -1)
    )
    minutes_valid = match and int(match[4]) < 60 and int(match[6]) < 60
    if not (match and minutes_valid and 0 <= begin < _WHOLE_DAY and 0 < end <= _WHOLE_DAY):
        raise SettingsError(f"the quiet hours {text!r} cannot be read", expected=EXPECTED)
    first = _DAYS.index(match[1]) if match[1] else 0
    last = _DAYS.index(match[2]) if match[2] else first
    count = (last - first) % 7 + 1 if match[1] else 7
    return QuietPeriod(frozenset((first + n) % 7 for n in range(count)), begin, end)


def zone_of(name: str | None) -> tzinfo | None:
    """The time zone of a name; None for that of the machine.

    Raises:
        SettingsError: It is unknown.
    """
    if name is None:
        return None
    try:
        return ZoneInfo(name)
    except (OSError, ValueError) as fault:  # ZoneInfoNotFoundError is a KeyError
        raise _unknown_zone(name) from fault
    except KeyError as fault:
        raise _unknown_zone(name) from fault


def _unknown_zone(name: str) -> SettingsError:
    return SettingsError(f"the time zone {name!r} is not known", expected="such as Europe/Berlin")


@dataclass(frozen=True, slots=True)
class QuietHours:
    """The quiet hours.

    Attributes:
        periods: The periods.
        zone: Their time zone; None for that of the machine.
    """

    periods: tuple[QuietPeriod, ...] = ()
    zone: tzinfo | None = None

    @classmethod
    def read(cls, texts: Sequence[str], zone: str | None) -> QuietHours:
        """Parse the quiet hours of a site file.

        Raises:
            SettingsError: They are not valid.
        """
        return cls(tuple(map(quiet_period, texts)), zone_of(zone))

    def hold(self, wall_s: float) -> bool:
        """Whether a time is in quiet hours.

        Args:
            wall_s: Seconds since 1970.
        """
        local = datetime.fromtimestamp(wall_s, self.zone)
        minute = local.hour * 60 + local.minute
        return any(p.holds(local.weekday(), minute) for p in self.periods)

    def hold_throughout(self, since_s: float, until_s: float) -> bool:
        """Whether a whole interval is in quiet hours, to the minute.

        Args:
            since_s: Seconds since 1970.
            until_s: The same, later.
        """
        step = timedelta(minutes=1).total_seconds()
        count = min(int((until_s - since_s) / step) + 1, 7 * _WHOLE_DAY)
        return all(self.hold(since_s + n * step) for n in range(count)) and self.hold(until_s)


class QuietGate:
    """Decides which alerts of a step are sent now.

    Args:
        hours: The quiet hours.
        wall: Source time -> seconds since 1970, or None if not known.
        resumed_at: Time of the last step before this process, seconds since 1970; None for a new run.
    """

    def __init__(
        self,
        hours: QuietHours,
        wall: Callable[[float], float | None],
        resumed_at: float | None = None,
    ) -> None:
        self._hours, self._wall, self._resumed_at = hours, wall, resumed_at
        self._held: set[int] = set()

    def __call__(self, step: Step) -> Sequence[Alert]:
        """The alerts to send after a step."""
        now = self._wall(step.time)
        quiet = now is not None and self._hours.hold(now)
        self._restore_held(step)
        due: list[Alert] = []
        for alert in step.alerts:
            if alert.closed is None and quiet and alert.severity < Severity.CRITICAL:
                self._held.add(alert.id)
            elif alert.id in self._held:
                self._held.discard(alert.id)  # opened and closed unsent
            else:
                due.append(alert)
        return (*due, *self._released(step, quiet=quiet))

    def _released(self, step: Step, *, quiet: bool) -> Sequence[Alert]:
        """Held alerts that are sent now: quiet hours have ended, or they became critical."""
        released = [
            a
            for a in step.mind.alerts
            if a.id in self._held and not (quiet and a.severity < Severity.CRITICAL)
        ]
        self._held -= {a.id for a in released}
        return released

    def _restore_held(self, step: Step) -> None:
        """Restore the alerts held by an earlier process: those opened in quiet hours that had not ended."""
        at, self._resumed_at = self._resumed_at, None
        if at is None:
            return
        new = {a.id for a in step.alerts}
        for alert in step.mind.alerts:
            opened = self._wall(alert.opened)
            held = alert.id not in new and alert.severity < Severity.CRITICAL
            if held and opened is not None and self._hours.hold_throughout(opened, max(at, opened)):
                self._held.add(alert.id)
