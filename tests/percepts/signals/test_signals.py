"""Signals beside the video: read as they stand, known when they are told, asked for by rules and tasks."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import visup
from tests.clips import moving_disc, write_clip
from visup.agent import Mind, Percept, Truth
from visup.agent.model.errors import SettingsError, VisupError
from visup.percepts.signals import SignalTable, read_signals
from visup.percepts.signals.behaviour import Value
from visup.percepts.signals.mqtt import read_payload
from visup.rules.formula.truth import TRUTH_OF
from visup.rules.language.parser import parse_rules
from visup.rules.predicates import signals
from visup.rules.predicates.snapshot import Snapshot
from visup.tasks import parse_task
from visup.tasks.grammar.structure import signals_named, stage_names, task_actors

VALUES = st.one_of(
    st.floats(-1e6, 1e6), st.booleans(), st.sampled_from(("auto", "manual", "a b")), st.none()
)


def written(path: Path, rows: Sequence[tuple[float, Mapping[str, Value | None]]]) -> Path:
    lines = ["time,level,mode"]
    for time, row in rows:
        cells = ("" if v is None else repr(v) if isinstance(v, float) else str(v) for v in (
            row["level"], row["mode"]))  # fmt: skip
        lines.append(",".join([repr(time), *cells]))
    path.write_text("\n".join(lines) + "\n")
    return path


@given(
    st.lists(st.floats(0, 100), unique=True, max_size=8).map(sorted),
    st.data(),
    st.floats(-1, 110),
)
def test_a_table_says_what_the_last_row_says(
    times: list[float], data: st.DataObject, asked: float
) -> None:
    rows = [(t, {"level": data.draw(VALUES), "mode": data.draw(VALUES)}) for t in times]
    with tempfile.TemporaryDirectory() as folder:
        table = read_signals(written(Path(folder) / "s.csv", rows))
    before = [row for t, row in rows if t <= asked]
    expected = {n: v for n, v in before[-1].items() if v is not None} if before else {}
    assert dict(table.at(asked)) == expected
    assert table.names == {"level", "mode"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "does not name them"),
        ("seconds,battery\n0,1\n", "does not name them"),
        ("time\n0\n", "does not name them"),
        ("time,a,a\n0,1,1\n", "does not name them"),
        ("time,my signal\n0,1\n", "does not name them"),
        ("time,a\n0,1\n0,2\n", "does not come after"),
        ("time,a\n1,1\n0.5,2\n", "does not come after"),
        ("time,a\nnan,1\n", "does not come after"),
        ("time,a\nsoon,1\n", "does not come after"),
        ("time,a\n0,1,2\n", "has 3 values"),
        ('time,a\n0,"1\n', "cannot be read"),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "s.csv"
    path.write_text(text)
    with pytest.raises(SettingsError, match=said) as told:
        read_signals(path)
    assert told.value.expected


def test_what_is_no_file_is_refused_in_words(tmp_path: Path) -> None:
    (tmp_path / "binary.csv").write_bytes(b"time,a\n0,\xff\xfe")
    for path in (tmp_path / "none.csv", tmp_path, tmp_path / "binary.csv", Path("/dev/zero")):
        with pytest.raises(SettingsError, match="cannot be read"):
            read_signals(path)


def knowing(values: Mapping[str, object]) -> Snapshot:
    return Snapshot(Mind(percepts={"signal": (Percept("signal", values, 0.0, "signals"),)}))


@given(st.one_of(VALUES, st.integers(-5, 5)))
def test_words_about_signals_know_what_is_told_and_no_more(value: Value | None) -> None:
    facts = knowing({} if value is None else {"x": value})
    low, high = signals.number(facts, "x")
    on, known = (TRUTH_OF[int(f(facts, "x"))] for f in (signals.is_on, signals.is_known))
    auto = TRUTH_OF[int(signals.is_word(facts, "x", "auto"))]
    assert known is (Truth.FALSE if value is None else Truth.TRUE)
    if isinstance(value, bool):
        assert on is (Truth.TRUE if value else Truth.FALSE)
        assert (low, high) == (-math.inf, math.inf)
    elif isinstance(value, int | float):
        assert (low, high) == (value, value)
        assert on is (Truth.TRUE if value else Truth.FALSE)
    else:
        assert (low, high) == (-math.inf, math.inf)
        assert on is Truth.UNKNOWN
    unknown = value is None
    assert auto is (Truth.UNKNOWN if unknown else Truth.TRUE if value == "auto" else Truth.FALSE)


RULES = """
rule low_battery(): warning
    when signal(battery) < 20 for 0.3 s and signal_is(mode, auto)
    unless signal_on(charging)
    say "The battery is low."
"""
TABLE = "time,battery,mode,charging\n0,80,auto,no\n0.4,10,auto,no\n1.0,10,auto,yes\n"


def clip(folder: Path) -> Path:
    return write_clip(folder / "clip.avi", moving_disc(45), fps=20.0)


def test_rules_alert_by_what_signals_say(tmp_path: Path) -> None:
    (tmp_path / "own.rules").write_text(RULES)
    (tmp_path / "own.csv").write_text(TABLE)
    run = visup.watch(
        str(clip(tmp_path)), rules=[tmp_path / "own.rules"], signals=[tmp_path / "own.csv"]
    )
    low = [s.time for s in run if any(a.kind == "low_battery" for a in s.mind.alerts)]
    assert low[0] == pytest.approx(0.7, abs=0.05)  # 0.3 s after 0.4 s
    assert 1.0 <= low[-1] < 2.2  # then it charges


def test_a_signal_that_nobody_tells_is_refused_with_what_is_meant(tmp_path: Path) -> None:
    (tmp_path / "own.rules").write_text(RULES.replace("(battery)", "(batery)"))
    (tmp_path / "own.csv").write_text(TABLE)
    with pytest.raises(VisupError, match="batery") as told:
        list(visup.watch(
            str(clip(tmp_path)), rules=[tmp_path / "own.rules"], signals=[tmp_path / "own.csv"]
        ))  # fmt: skip
    assert "battery" in str(told.value)
    with pytest.raises(VisupError, match="no source provides"):
        list(visup.watch(str(clip(tmp_path)), rules=[tmp_path / "own.rules"]))


TASK = """
<charge> ::= <dock> <full>
<dock>   ::= converging(vehicle, charger) ends when signal_on(docked)
<full>   ::= signal(battery) > 90 fails when signal_is(mode, fault)
never signal(temperature) > 60 for 2 s
"""


def test_tasks_ask_for_signals_which_are_no_actors() -> None:
    task = parse_task(TASK)
    assert task_actors(task) == ("vehicle", "charger")
    assert stage_names(task) == ("dock", "full")
    assert set(signals_named(task)) == {"docked", "battery", "mode", "temperature"}
    assert parse_task(str(task)) == task


def test_a_task_goes_by_what_signals_say(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text("time,level,door\n0,5,no\n0.3,50,no\n0.9,50,yes\n")
    for least, door, verdict in ((40, "door", "succeeded"), (60, "door", "unknown")):
        (tmp_path / "own.task").write_text(
            f"<fill> ::= <full> <shut>\n<full> ::= signal(level) > {least} for 0.2 s\n"
            f"<shut> ::= signal_on({door}) for 0.2 s\nbystanders ignored\n"
        )
        run = visup.watch(
            str(clip(tmp_path)), task=tmp_path / "own.task", signals=[tmp_path / "own.csv"]
        )
        for _ in run:
            pass
        assert run.verdict is not None
        assert (run.verdict.value == "succeeded") == (verdict == "succeeded")


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("<t> ::= gap(a, b) < 20", "no unit"),
        ("<t> ::= signal(x)", "not compared"),
        ("<t> ::= signal_on(x) < 5 px", "not a quantity"),
        ("<t> ::= signal_is(x)", "given 1 actor"),
    ],
)
def test_mistakes_with_signals_are_told(text: str, rule: str) -> None:
    with pytest.raises(VisupError, match=rule):
        parse_task(text)


@given(st.binary(max_size=400))
def test_any_message_of_a_broker_is_a_value_or_nothing(payload: bytes) -> None:
    found = read_payload(payload)
    assert found is None or isinstance(found, bool | str) or math.isfinite(found)


@pytest.mark.parametrize(
    ("payload", "value"),
    [
        (b"1.5", 1.5), (b"true", True), (b'"auto"', "auto"), (b"auto", "auto"), (b"", None),
        (b"1e999", None), (b"[1]", None), (b"NaN", None), (b'{"a": 1}', None),
    ],
)  # fmt: skip
def test_messages_are_plain_or_json(payload: bytes, value: Value | None) -> None:
    assert read_payload(payload) == value


def test_rules_print_themselves_back() -> None:
    (rule,) = parse_rules(RULES)
    assert parse_rules(str(rule)) == (rule,)
    assert isinstance(SignalTable((), (), frozenset()).at(1.0), Mapping)
