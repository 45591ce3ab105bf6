"""Runs as read by the console: beliefs at each moment, and their explanations."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.archive.recordings import meeting, record
from tests.rules.scenes import box_region, seen
from visup.agent import Observation
from visup.agent.model.errors import VisupError
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.wall_clock import WallClock
from visup.console.library import RunLibrary, run_key
from visup.console.pages.playhead import Playhead
from visup.console.pages.wall_page import latest_by_camera
from visup.console.questions import open_questions
from visup.console.reasoning.inquiry import Inquiry
from visup.console.run_view import RunView
from visup.console.state import ConsoleState
from visup.runs.settings import WatchSettings

SETTINGS = WatchSettings(
    "clip.mp4", tasks=("dock",), actors={"arm": ("arm",), "satellite": ("spartan",)}
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Sequence[Step]]:
    folder = tmp_path_factory.mktemp("runs") / "one"
    return folder, record(folder, meeting(), SETTINGS)


def test_recorded_minds_equal_the_original_beliefs(run: tuple[Path, Sequence[Step]]) -> None:
    folder, steps = run
    view = RunView(folder)
    assert view.frames == [s.frame_index for s in steps]
    for number, step in enumerate(steps):
        read, mind = view.mind(number), step.mind
        assert {b.id: (b.presence, b.name, b.confirmed) for b in read.objects.values()} == {
            b.id: (b.presence, b.name, b.confirmed) for b in mind.objects.values()
        }
        seen = [b.id for b in mind.present() if b.last_seen == mind.time]
        assert all(read.objects[i].region.bbox == mind.objects[i].region.bbox for i in seen)
        assert [(t.task, t.verdict, t.current) for t in read.tasks] == [
            (t.task, t.verdict, t.current) for t in mind.tasks
        ]
        assert [s.status for t in read.tasks for s in t.stages] == [
            s.status for t in mind.tasks for s in t.stages
        ]
        assert {a.id for a in read.alerts} == {a.id for a in mind.alerts}


def test_a_refreshed_view_equals_one_of_the_whole_run(tmp_path: Path) -> None:
    folder, views = tmp_path / "a", list[RunView]()

    def observations() -> Iterator[Observation]:
        for number, observation in enumerate(meeting()):
            if number in (20, 21, 45):
                views.append(views[-1].refreshed() if views else RunView(folder))
                assert not views[-1].ended
            yield observation

    record(folder, observations(), SETTINGS)
    view, whole = views[-1].refreshed(), RunView(folder)
    assert len(views[0].frames) < len(views[-1].frames) < len(view.frames) == 60
    assert (view.frames, view.times, view.ended) == (whole.frames, whole.times, True)
    assert (view.tracks, view.events, view.alerts) == (whole.tracks, whole.events, whole.alerts)
    assert view.pictures is not None
    assert view.refreshed() is view


def test_a_run_resumed_from_an_earlier_step_is_read_again(tmp_path: Path) -> None:
    """A run resumed from an earlier step repeats the later ones."""
    record(tmp_path / "a", meeting(), SETTINGS, ended=None)
    view = RunView(tmp_path / "a")
    with closing(sqlite3.connect(tmp_path / "a" / JOURNAL)) as db:
        db.execute("DELETE FROM steps WHERE frame_index >= 40")
        db.commit()
    assert view.refreshed().frames == list(range(40))


def test_every_moment_has_a_picture(run: tuple[Path, Sequence[Step]]) -> None:
    view = RunView(run[0])
    width, height = view.mind(0).frame_size
    for number in (0, 30, 59):
        picture = cv2.imdecode(np.frombuffer(view.picture(number), np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert picture.shape == (height, width, 3)
    assert view.picture(30, plain=True) != view.picture(30)
    assert "no longer available" in view.pictures.problem


def test_times_and_frames_map_to_the_last_moment_not_after_them(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    for time in (-1.0, 0.0, 0.05, 2.0, 2.04, 99.0):
        expected = max((n for n, t in enumerate(view.times) if t <= time + 1e-6), default=0)
        assert view.moment_at(time) == expected
    assert view.moment_of_frame(17) == 17


def test_explanations_and_branches_are_those_of_the_stepper(
    run: tuple[Path, Sequence[Step]],
) -> None:
    inquiry = Inquiry(run[0])
    assert "arm" in str(inquiry.why(40, "identity 1"))
    assert str(inquiry.why(20, "not coupled 1 2"))
    with pytest.raises(VisupError):
        inquiry.why(10, "nonsense 99")
    with pytest.raises(VisupError):
        inquiry.why(10, "")
    other = inquiry.what_if(20, "object 2 arm", 60)
    assert other.differences
    assert other.end == pytest.approx(5.9)
    assert not inquiry.what_if(60, "object 2 arm", 60).differences.new


def ambiguous_observations(count: int = 60) -> Iterator[Observation]:
    """An object that resembles two models, so that the operator is asked."""
    for i in range(count):
        region = box_region(1, (200 + i, 200, 80, 60))
        similarities = (0.8, 0.75) if i % 2 else (0.75, 0.8)
        yield seen(i, [region], 10.0, {1: list(zip(("arm", "spartan"), similarities, strict=True))})


def test_an_answer_can_be_tried_without_giving_it(tmp_path: Path) -> None:
    record(tmp_path / "a", ambiguous_observations(), SETTINGS)
    view, inquiry = RunView(tmp_path / "a"), Inquiry(tmp_path / "a")
    (question,) = open_questions(view.events, view.seconds)
    assert set(question.names) == {"arm", "spartan"}
    number = view.moment_at(question.asked) + 1
    comparison = inquiry.what_if_answered(number, 1, "spartan", 60)
    texts = [str(e["text"]) for e in comparison.differences.new]
    assert any("operator says that object 1 is the satellite" in text for text in texts)
    for wrong in ((99, "arm"), (1, "nobody knows this")):
        with pytest.raises(VisupError):
            inquiry.what_if_answered(number, *wrong, 60)
    assert inquiry.mind(60).answers == {}


def test_a_run_can_be_rerun_with_a_text_but_not_with_files(
    run: tuple[Path, Sequence[Step]],
) -> None:
    inquiry = Inquiry(run[0])
    task = "<go> ::= <near>\n<near> ::= converging(arm, satellite)\n"
    assert inquiry.rerun_with("task", task, 60).differences
    for text in ("include 'secret.task'\n<a> ::= <b>", "<a> ::= <b> include '/etc/passwd'"):
        with pytest.raises(VisupError, match="cannot include"):
            inquiry.rerun_with("task", text, 60)
    with pytest.raises(VisupError):
        inquiry.rerun_with("task", "<a> ::= nonsense", 60)


def test_only_runs_below_the_given_folders_are_listed(
    run: tuple[Path, Sequence[Step]], tmp_path: Path
) -> None:
    folder, _ = run
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "journal.sqlite").write_bytes(b"no journal")
    (tmp_path / "link").symlink_to(folder)
    library = RunLibrary([tmp_path])
    (entry,) = library.scan()
    assert entry.problem
    with pytest.raises(VisupError):
        library.folder(run_key(folder))
    with pytest.raises(VisupError):
        ConsoleState(library).view("../../etc")
    with pytest.raises(VisupError):
        RunLibrary([tmp_path / "nowhere"])
    (whole,) = RunLibrary([folder.parent]).scan()
    assert (whole.tasks, whole.ended, whole.problem) == (("dock",), True, "")
    assert latest_by_camera([entry, whole]) == []


def test_a_live_run_is_listed_and_not_ended(tmp_path: Path) -> None:
    record(tmp_path / "a", meeting(20), SETTINGS, ended=None)
    view = RunView(tmp_path / "a")
    assert view.refreshed() is view
    assert not view.ended
    (entry,) = RunLibrary([tmp_path]).scan()
    assert latest_by_camera([entry]) == [entry]


def test_the_playhead_stays_within_the_run_and_jumps_to_events(
    run: tuple[Path, Sequence[Step]],
) -> None:
    head, moves = Playhead(RunView(run[0])), []
    head.listen(lambda: moves.append(head.number))
    head.step(-5)
    assert (head.number, moves) == (0, [])
    head.go(999)
    assert head.number == 59
    times = sorted({e.time for e in head.run.events})
    head.go(0)
    visited = []
    for _ in times:
        head.next_event()
        visited.append(head.run.times[head.number])
    later = [t for t in times if t > 0.0]
    assert visited == pytest.approx(later + [times[-1]] * (len(times) - len(later)))
    head.next_event(forward=False)
    assert head.run.times[head.number] == pytest.approx(times[-2])
    notified: list[str] = []
    head.listen(lambda: notified.append(head.panel), "Events")
    head.step(-1)
    assert notified == []
    head.open_panel("Events")
    assert notified == ["Events"]
    head.go(0)
    head.toggle()
    for _ in range(80):
        head.tick(0.1)
    assert (head.number, head.playing) == (59, False)
    head.toggle()
    assert (head.number, head.playing) == (0, True)


def test_a_run_of_a_camera_has_wall_clock_times_and_starts_at_its_first_moment(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    assert view.cursor_text(view.seconds).startswith("0:")
    view.times = [t + 1800.0 for t in view.times]
    view.__dict__["clock"] = WallClock(((0.0, 1795455235.0), (view.start, 1795500000.0)))
    assert (view.share(view.start), view.share(view.seconds)) == (0.0, 1.0)
    assert view.time_text(view.start) == "06:00:00"
    assert view.time_text(0.0) == "11-23 17:33:55"  # of an alert that was open before
    assert view.cursor_text(view.start) == "2026-11-24 06:00:00 UTC"
    head = Playhead(view)
    head.go_to_share(0.5)
    assert head.number == pytest.approx(len(view.frames) / 2, abs=1)
    at = head.number
    head.drag_to_share(view.share(view.times[at]) + 0.002)  # less than to the next moment
    assert head.number == at + 1
    head.drag_to_share(1.0)
    assert head.number == len(view.frames) - 1
    head.drag_to_share(0.0)
    assert head.number == 0


def test_the_timeline_outlasts_an_unreadable_moment(tmp_path: Path) -> None:
    record(tmp_path / "a", meeting(), SETTINGS)
    whole = [t.label for t in RunView(tmp_path / "a").tracks]
    with closing(sqlite3.connect(tmp_path / "a" / JOURNAL)) as db:
        db.execute("UPDATE steps SET summary = '{' WHERE frame_index = 20")
        db.commit()
    view = RunView(tmp_path / "a")
    assert [t.label for t in view.tracks] == whole
    assert len(list(view.identity_shares(1))) == len(view.frames) - 1
