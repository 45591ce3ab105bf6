"""What sinks did not take waits in a file: over kills and failures nothing is lost, nothing told twice."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal_reader import Recording
from visup.runs.inputs.audience import Audience
from visup.runs.resume import interrupted_run
from visup.runs.runner import fresh_folder, supervised
from visup.runs.settings import RunOptions, WatchSettings
from visup.sinks import delivery_log, durable_outbox
from visup.sinks.delivery_log import DELIVERY, DeliveryLog
from visup.sinks.durable_outbox import DurableOutbox
from visup.sinks.lines import JsonLines
from visup.sinks.webhook import DeliveryError

ACTS = st.lists(
    st.sampled_from(["tell", "tell two", "send a", "send b", "kill"]), min_size=1, max_size=40
)


@settings(max_examples=20)
@given(ACTS)
def test_every_sink_gets_every_record_in_order_despite_kills(
    tmp_path_factory: pytest.TempPathFactory, acts: list[str]
) -> None:
    path = tmp_path_factory.mktemp("log") / "deliveries.sqlite"
    log, told, frame = DeliveryLog(path), 0, 0
    got: dict[str, list[int]] = {"a": [], "b": []}
    for act in acts:
        if act.startswith("tell"):
            count = 1 + act.endswith("two")
            log.add(["a", "b"], [{"n": told + i} for i in range(count)], frame)
            assert log.last_frame == frame
            told, frame = told + count, frame + 1
        elif act == "kill":
            log.close()
            log = DeliveryLog(path)
            assert log.last_frame == frame - 1
        elif waiting := log.oldest(act[-1]):
            got[act[-1]].append(waiting[1]["n"])
            log.done(waiting[0])
    for sink, taken in got.items():
        assert log.count(sink) == told - len(taken)
        while waiting := log.oldest(sink):
            taken.append(waiting[1]["n"])
            log.done(waiting[0])
        assert taken == list(range(told))
    log.close()


def test_on_overflow_the_oldest_records_are_dropped_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(delivery_log, "MAX_WAITING", 3)
    log = DeliveryLog(tmp_path / "d.sqlite")
    assert [log.add(["a"], [{"n": n}]) for n in range(5)] == [0, 0, 0, 1, 1]
    found = log.oldest("a")
    assert found
    assert found[1]["n"] == 2
    log.close()


def test_an_invalid_queue_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / "d.sqlite").write_text("no database, but long enough to be read as one")
    with pytest.raises(OutputError, match="queue of undelivered alerts"):
        DeliveryLog(tmp_path / "d.sqlite")


class Flaky:
    """A sink that fails as it is told to."""

    name = "flaky"

    def __init__(self, *faults: Exception | None) -> None:
        self.faults, self.got = list(faults), [0][:0]

    def deliver(self, record: Mapping[str, Any]) -> None:
        fault = self.faults.pop(0) if self.faults else None
        if fault:
            raise fault
        self.got.append(record["n"])

    def close(self) -> None:
        pass


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[DeliveryLog]:
    monkeypatch.setattr(durable_outbox, "INITIAL_WAIT_S", 0.01)
    made = DeliveryLog(tmp_path / "d.sqlite")
    yield made
    made.close()


def wait_for(what: Callable[[], object]) -> None:
    end = time.monotonic() + 10.0
    while not what():
        assert time.monotonic() < end, "it did not come in time"
        time.sleep(0.005)


def test_a_sink_that_was_down_gets_all_records_and_a_refusal_blocks_none(log: DeliveryLog) -> None:
    down = [OSError("down"), OSError("down")]
    sink = Flaky(*down, None, DeliveryError("no", final=True))
    outbox = DurableOutbox(sink, "0", log)
    log.add(["0"], [{"n": n} for n in range(4)])
    outbox.wake()
    wait_for(lambda: log.count("0") == 0)
    assert sink.got == [0, 2, 3]
    assert (outbox.delivered, outbox.failed, outbox.fault) == (3, 1, "")
    outbox.offer({"n": 9})  # what could not be written to the log
    wait_for(lambda: 9 in sink.got)
    outbox.close(1.0)
    assert outbox.note


def test_a_sink_that_stays_down_is_reported_and_closes_in_time(log: DeliveryLog) -> None:
    outbox = DurableOutbox(Flaky(*[OSError("down")] * 1000), "0", log)
    log.add(["0"], [{"n": 1}])
    outbox.wake()
    wait_for(lambda: outbox.fault)
    (fault,) = outbox.runtime_faults()
    assert "down" in fault.evidence[0]
    begin = time.monotonic()
    outbox.close(5.0)
    assert time.monotonic() - begin < 4.0
    assert log.count("0") == 1
    assert not any(t.name == "sink flaky" for t in threading.enumerate())


def test_alerts_of_a_run_killed_while_its_sink_was_down_are_delivered_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(40))
    rules = tmp_path / "own.rules"
    rules.write_text(
        'rule seen(a): warning\n    when in_view(a) > 0.1 s\n    say "{a} {is} seen."\n'
    )
    told, run = tmp_path / "alerts.jsonl", tmp_path / "run"
    options = RunOptions(
        video=False,
        report=False,
        sinks=(f"file:{told}",),
        deliveries=tmp_path / "deliveries.sqlite",
        closing_s=0.2,
    )
    watched = WatchSettings(str(clip), rules=(rules,))

    def down(sink: JsonLines, record: Mapping[str, Any]) -> None:
        raise OSError("down")

    with monkeypatch.context() as broken:
        broken.setattr(JsonLines, "deliver", down)
        begun = supervised(watched, fresh_folder(run, ""), Audience(), options)
        for _ in islice(begun, 30):
            pass
        begun.close()
    assert told.read_text() == ""
    log = DeliveryLog(tmp_path / "deliveries.sqlite")
    waiting = log.oldest("0 file:" + str(told))
    assert waiting
    # As if it had been killed after the journal, and before anything was noted.
    log._db.execute("DELETE FROM waiting")
    log.begin()
    log.close()
    past = interrupted_run(run)
    for _ in supervised(past.settings, run, Audience(), options, past):
        pass
    records = [json.loads(line) for line in told.read_text().splitlines()]
    sent = sorted((r["id"], r["state"]) for r in records if r["record"] == "alert")
    alerts = Recording.open(run).alerts().values()
    states = [(a["id"], "opened") for a in alerts]
    states += [(a["id"], "closed") for a in alerts if a["closed"] is not None]
    of_sinks = {a["id"] for a in alerts if a["kind"] == "sink_failed"}
    assert [s for s in sent if s[0] not in of_sinks] == sorted(
        s for s in states if s[0] not in of_sinks
    )
    assert len(sent) == len(set(sent)) > 0
    assert len({r[DELIVERY] for r in records}) == len(records)
