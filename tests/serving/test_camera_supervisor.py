"""One camera's supervisor: whatever its process does, one is running, and never two."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.serving.fakes import Bench, begun_journal, site_camera
from visup.serving.backoff import HEALTHY_S, MAX_WAIT_S, Backoff
from visup.serving.camera_supervisor import KILL_AFTER_S, CameraState, CameraSupervisor
from visup.serving.reports import ReportKind

STEP, NOTICE = ReportKind.STEP, ReportKind.NOTICE
ENDED, REFUSED = ReportKind.ENDED, ReportKind.REFUSED


@given(st.lists(st.floats(0.0, 2 * HEALTHY_S), min_size=1, max_size=60))
def test_waits_grow_up_to_a_limit_and_are_reset_after_a_healthy_run(ran: list[float]) -> None:
    backoff, last = Backoff(), 0.0
    for ran_s in ran:
        backoff = backoff.after(ran_s)
        expected = 1.0 if ran_s >= HEALTHY_S or not last else min(MAX_WAIT_S, 2 * last)
        assert backoff.wait_s == expected
        last = backoff.wait_s


class Cell:
    """A camera that is watched over, and the clock."""

    def __init__(self, store: Path) -> None:
        self.bench = Bench()
        self.now = 0.0
        self.store = store
        self.supervisor = CameraSupervisor(site_camera(), store, self.bench.tell, self.bench.start)

    def tick(self, later_s: float = 0.0) -> None:
        self.now += later_s
        self.supervisor.tick(self.now)

    def step(self) -> None:
        begun_journal(self.bench.last.job.folder)
        self.bench.last.tell(STEP, steps=1)
        self.tick()

    @property
    def state(self) -> CameraState:
        return self.supervisor.state


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    made = Cell(tmp_path / "store")
    made.tick()
    return made


def test_a_camera_starts_at_once_and_is_watched_from_its_first_step(cell: Cell) -> None:
    states = [cell.state]
    assert not cell.bench.last.job.resume
    cell.step()
    states.append(cell.state)
    assert states == [CameraState.STARTING, CameraState.WATCHING]


def test_a_process_that_died_resumes_its_run(cell: Cell) -> None:
    cell.step()
    cell.bench.last.code = -9
    cell.tick(5.0)
    assert cell.state is CameraState.WAITING
    assert "its process died (signal 9); restarting in 1 s" in cell.bench.lines[-1]
    cell.tick(0.9)
    assert len(cell.bench.children) == 1
    cell.tick(0.2)
    first, second = cell.bench.children
    assert second.job.resume
    assert second.job.folder == first.job.folder
    assert first.closed


@pytest.mark.parametrize(
    ("stepped", "away", "most"), [(False, False, 30.0), (True, False, 10.0), (True, True, 30.0)]
)
def test_a_hanging_process_is_killed(cell: Cell, stepped: bool, away: bool, most: float) -> None:
    """A camera that dropped is tried again for its patience, in which no step can be."""
    if stepped:
        cell.step()
    if away:
        cell.bench.last.tell(NOTICE, text="it delivers no frames; trying again.")
        cell.tick()
    cell.tick(most)
    assert cell.bench.running
    cell.tick(0.1)
    assert not cell.bench.running
    cell.tick()
    assert cell.state is CameraState.WAITING


def test_any_report_counts_as_a_sign_of_life(cell: Cell) -> None:
    for _ in range(20):
        cell.step()
        cell.tick(9.0)
    assert len(cell.bench.children) == 1
    assert cell.bench.running


def test_a_process_that_uses_too_much_memory_is_restarted(cell: Cell) -> None:
    cell.step()
    cell.bench.last.memory = 1000.1
    cell.tick(1.0)
    assert cell.bench.last.asked == 1
    cell.tick()
    cell.tick()
    assert len(cell.bench.children) == 2
    assert cell.bench.last.job.resume
    assert any("1000 MB in use, 1000 allowed" in line for line in cell.bench.lines)


def test_a_run_whose_state_crashes_every_process_is_abandoned(cell: Cell) -> None:
    cell.step()
    first = cell.bench.last.job.folder
    resumed = []
    for _ in range(5):
        cell.bench.last.code = -11
        cell.tick()
        cell.tick(MAX_WAIT_S)
        resumed.append(cell.bench.last.job.resume)
    assert resumed == [True, True, True, False, False]
    assert cell.bench.last.job.folder != first


@pytest.mark.parametrize(("because_of_the_source", "goes_on"), [(True, True), (False, False)])
def test_a_refused_run_is_abandoned_unless_its_camera_is_unreachable(
    cell: Cell, because_of_the_source: bool, goes_on: bool
) -> None:
    cell.step()
    cell.bench.last.code = -9
    cell.tick()
    cell.tick(1.0)
    cell.bench.last.tell(REFUSED, text="no", source=because_of_the_source)
    cell.bench.last.code = 2
    cell.tick()
    cell.tick(10.0)
    assert cell.bench.last.job.resume is goes_on


@pytest.mark.parametrize(
    ("live", "state"), [(False, CameraState.OVER), (True, CameraState.WAITING)]
)
def test_a_file_is_watched_once_and_a_camera_without_end(
    cell: Cell, live: bool, state: CameraState
) -> None:
    cell.step()
    cell.bench.last.tell(ENDED, live=live, verdict=None, steps=7, problem=None)
    cell.bench.last.code = 0
    cell.tick()
    assert cell.state is state
    assert "verdict none after 7 frames" in cell.bench.lines[-1]


def test_a_stop_by_the_service_is_not_reported_as_one_by_the_user(cell: Cell) -> None:
    cell.step()
    cell.supervisor.stop(cell.now)
    problem = {"problem": "stopped by the user", "stopped": True}
    cell.bench.last.tell(ENDED, live=True, verdict="failed", steps=7, **problem)
    cell.bench.last.code = 0
    cell.tick()
    assert cell.bench.lines[-1].endswith("verdict failed after 7 frames; it is no longer watched")


@pytest.mark.parametrize("stubborn", [False, True])
def test_a_stop_takes_limited_time(cell: Cell, stubborn: bool) -> None:
    cell.step()
    cell.bench.last.stubborn = stubborn
    cell.supervisor.stop(cell.now)
    begun = cell.now
    while cell.state is not CameraState.OVER:
        cell.tick(0.1)
        assert cell.now - begun <= KILL_AFTER_S + 0.3
    assert cell.supervisor.killed_on_close is stubborn
    assert cell.bench.last.asked == (2 if stubborn else 1)
    assert cell.bench.last.closed


def test_changed_settings_apply_after_a_clean_end(cell: Cell) -> None:
    cell.step()
    cell.supervisor.replace(site_camera(source="1", fingerprint="b"), cell.now)
    cell.tick(0.1)
    cell.tick(0.1)
    first, second = cell.bench.children
    assert (first.asked, first.closed) == (1, True)
    assert second.job.settings.source == "1"
    assert not second.job.resume


def test_a_changed_sink_applies_and_beliefs_are_kept(cell: Cell) -> None:
    cell.step()
    cell.supervisor.replace(site_camera(source="1", fingerprint="a"), cell.now)
    cell.tick(0.1)
    cell.tick(0.1)
    assert cell.bench.last.job.resume


def test_an_unwritable_store_is_retried(tmp_path: Path) -> None:
    (tmp_path / "store").write_text("no folder")
    cell = Cell(tmp_path / "store")
    cell.tick()
    assert not cell.bench.children
    assert "next try in 1 s" in cell.bench.lines[-1]
    (tmp_path / "store").unlink()
    cell.tick(1.0)
    assert cell.bench.running


ACTS = st.sampled_from(
    ["step", "notice", "die", "end", "refuse", "swell", "replace", "wait", "long", "stubborn"]
)
COUNT = itertools.count()


@settings(max_examples=30)
@given(acts=st.lists(ACTS, max_size=30))
def test_there_is_always_at_most_one_process_and_it_can_be_stopped(
    tmp_path_factory: pytest.TempPathFactory, acts: list[str]
) -> None:
    cell = Cell(tmp_path_factory.mktemp("store") / str(next(COUNT)))
    for number, act in enumerate(acts):
        cell.tick(0.5)
        running = cell.bench.running
        assert len(running) <= 1
        later = {"wait": 2.0, "long": MAX_WAIT_S}.get(act, 0.0)
        for child in running:
            if act == "step":
                cell.step()
            elif act == "notice":
                child.tell(NOTICE, text="it is away")
            elif act in ("end", "refuse"):
                child.tell(ENDED if act == "end" else REFUSED, live=True, text="no")
                child.code = 2
            elif act == "die":
                child.code = -9
            elif act == "swell":
                child.memory = 2000.0
            elif act == "stubborn":
                child.stubborn = True
        if act == "replace":
            cell.supervisor.replace(site_camera(source=str(number)), cell.now)
        cell.tick(later)
    for _ in range(200):  # left alone it is watched, or begun again soon
        cell.tick(0.5)
        if cell.bench.running:
            break
    assert cell.bench.running
    cell.supervisor.stop(cell.now)
    for _ in range(20):
        cell.tick(0.5)
    assert cell.state is CameraState.OVER
    assert not cell.bench.running
    assert all(child.closed for child in cell.bench.children)
