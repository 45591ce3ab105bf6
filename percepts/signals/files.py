"""Tables of signals: CSV whose first column is the time."""

from __future__ import annotations

import csv
import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.agent.storage.text_file import check_room, read_text_file
from visup.percepts.signals.behaviour import NAME, Value

MAX_BYTES, MAX_VALUES = 2**27, 6_000_000
TIME = "time"
TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
EXPECTED = (
    "CSV with a header such as `time,battery,door_open,mode` and rows such as `0.5,87.5,true,auto`, "
    "seconds of the video in rising order"
)


@dataclass(frozen=True, slots=True)
class SignalTable:
    """Signals over time; each row is valid until the next one.

    Attributes:
        times: Seconds, ascending.
        rows: Values from each time on.
        names: All columns.
    """

    times: Sequence[float]
    rows: Sequence[Mapping[str, Value]]
    names: frozenset[str]

    def at(self, time: float) -> Mapping[str, Value]:
        """The row valid at a time; empty before the first."""
        place = bisect_right(self.times, time)
        return self.rows[place - 1] if place else {}


def read_signals(path: Path) -> SignalTable:
    """Read a table of signals.

    Cells are numbers, `true`, `yes`, `on`, `false`, `no`, `off`, or words; an empty one makes the signal
    unknown from then on.

    Raises:
        SettingsError: The file cannot be read, or is not such a table; the message names the line.
    """
    try:
        text = read_text_file(path, MAX_BYTES)
        check_room(text.encode(), MAX_VALUES, b",\n")
        rows = list(csv.reader((f"{line}\n" for line in text.split("\n")), strict=True))
    except OSError as fault:
        what = f"the signals cannot be read ({fault.strerror or fault})"
        raise SettingsError(what, where=str(path), hint="check the path") from None
    except (ValueError, csv.Error) as fault:
        what = f"the signals cannot be read: {fault}"
        raise SettingsError(what, where=str(path), expected=EXPECTED) from None
    header, times, values = _header(rows, path), list[float](), list[dict[str, Value]]()
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        times.append(_time(row, times, len(header), f"{path}:{number}"))
        values.append({n: _value(c) for n, c in zip(header[1:], row[1:], strict=True) if c.strip()})
    return SignalTable(tuple(times), tuple(values), frozenset(header[1:]))


def _header(rows: list[list[str]], path: Path) -> list[str]:
    header = [c.strip() for c in rows[0]] if rows else []
    names = header[1:]
    fine = header[:1] == [TIME] and names and len(set(names)) == len(names)
    if not fine or not all(map(NAME.fullmatch, names)):
        raise SettingsError(
            "the first line of the signals does not name them",
            where=f"{path}:1",
            expected=EXPECTED,
            hint="names are letters, digits and _, each once",
        )
    return header


def _time(row: list[str], times: list[float], width: int, where: str) -> float:
    if len(row) != width:
        what = f"this row has {len(row)} values, the header {width}"
        raise SettingsError(what, where=where, expected="one value, or nothing, for each signal")
    try:
        time = float(row[0])
    except ValueError:
        time = math.nan
    if not math.isfinite(time) or (times and time <= times[-1]):
        what = f"the time {row[0]!r} does not come after the one before"
        raise SettingsError(what, where=where, expected="seconds of the video in rising order")
    return time


def _value(cell: str) -> Value:
    text = cell.strip()
    if text.lower() in TRUTHS:
        return TRUTHS[text.lower()]
    try:
        number = float(text)
    except ValueError:
        return text
    return number if math.isfinite(number) else text
