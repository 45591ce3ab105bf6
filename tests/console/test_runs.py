"""Runs as the console reads them: what the agent believed, at once, and why."""

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
from visup.console.questions import questions_at
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


def test_what_is_read_is_what_was_believed(run: tuple[Path, Sequence[Step]]) -> None:
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


def test_a_view_that_reads_on_is_that_of_the_whole_run(tmp_path: Path) -> None:
    folder, views = tmp_path / "a", list[RunView]()

    def looked_at() -> Iterator[Observation]:
        for number, perceived in enumerate(meeting()):
            if number in (20, 21, 45):
                views.append(views[-1].refreshed() if views else RunView(folder))
                assert not views[-1].ended
            yield perceived

    record(folder, looked_at(), SETTINGS)
    view, whole = views[-1].refreshed(), RunView(folder)
    assert len(views[0].frames) < len(views[-1].frames) < len(view.frames) == 60
    assert (view.frames, view.times, view.ended) == (whole.frames, whole.times, True)
    assert (view.tracks, view.events, view.alerts) == (whole.tracks, whole.events, whole.alerts)
    assert view.pictures is not None
    assert view.refreshed() is view


def test_a_run_that_was_taken_back_is_read_anew(tmp_path: Path) -> None:
    """A run that is resumed from an earlier step does the later ones again."""
    record(tmp_path / "a", meeting(), SETTINGS, ended=None)
    view = RunView(tmp_path / "a")
    with closing(sqlite3.connect(tmp_path / "a" / JOURNAL)) as db:
        db.execute("DELETE FROM steps WHERE frame_index >= 40")
        db.commit()
    assert view.refreshed().frames == list(range(40))


def test_every_moment_has_its_picture(run: tuple[Path, Sequence[Step]]) -> None:
    view = RunView(run[0])
    width, height = view.mind(0).frame_size
    for number in (0, 30, 59):
        picture = cv2.imdecode(np.frombuffer(view.picture(number), np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        assert picture.shape == (height, width, 3)
    assert view.picture(30, plain=True) != view.picture(30)
    assert "no longer available" in view.pictures.problem


def test_times_and_frames_lead_to_the_last_moment_that_is_not_later(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    for time in (-1.0, 0.0, 0.05, 2.0, 2.04, 99.0):
        twin = max((n for n, t in enumerate(view.times) if t <= time + 1e-6), default=0)
        assert view.at(time) == twin
    assert view.of_frame(17) == 17


def test_answers_are_those_of_stepping(run: tuple[Path, Sequence[Step]]) -> None:
    asked = Inquiry(run[0])
    assert "arm" in str(asked.why(40, "identity 1"))
    assert str(asked.why(20, "not coupled 1 2"))
    with pytest.raises(VisupError):
        asked.why(10, "nonsense 99")
    with pytest.raises(VisupError):
        asked.why(10, "")
    other = asked.what_if(20, "object 2 arm", 60)
    assert other.differs
    assert other.until == pytest.approx(5.9)
    assert not asked.what_if(60, "object 2 arm", 60).differs.new


def doubtful(count: int = 60) -> Iterator[Observation]:
    """A body that looks like two things, so that the operator is asked."""
    for i in range(count):
        region = box_region(1, (200 + i, 200, 80, 60))
        alike = (0.8, 0.75) if i % 2 else (0.75, 0.8)
        yield seen(i, [region], 10.0, {1: list(zip(("arm", "spartan"), alike, strict=True))})


def test_an_answer_is_tried_as_if_the_operator_had_given_it(tmp_path: Path) -> None:
    record(tmp_path / "a", doubtful(), SETTINGS)
    view, asked = RunView(tmp_path / "a"), Inquiry(tmp_path / "a")
    (question,) = questions_at(view.events, view.seconds)
    assert set(question.names) == {"arm", "spartan"}
    number = view.at(question.asked) + 1
    course = asked.as_if_answered(number, 1, "spartan", 60)
    told = [str(e["text"]) for e in course.differs.new]
    assert any("operator says that object 1 is the satellite" in text for text in told)
    for wrong in ((99, "arm"), (1, "nobody knows this")):
        with pytest.raises(VisupError):
            asked.as_if_answered(number, *wrong, 60)
    assert asked.mind(60).answers == {}


def test_a_run_is_judged_by_a_text_but_never_by_a_file(run: tuple[Path, Sequence[Step]]) -> None:
    asked = Inquiry(run[0])
    task = "<go> ::= <near>\n<near> ::= converging(arm, satellite)\n"
    assert asked.judged_by("task", task, 60).differs
    for text in ("include 'secret.task'\n<a> ::= <b>", "<a> ::= <b> include '/etc/passwd'"):
        with pytest.raises(VisupError, match="cannot include"):
            asked.judged_by("task", text, 60)
    with pytest.raises(VisupError):
        asked.judged_by("task", "<a> ::= nonsense", 60)


def test_only_runs_below_the_given_folders_are_known(
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


def test_a_run_that_goes_on_is_read_on(tmp_path: Path) -> None:
    record(tmp_path / "a", meeting(20), SETTINGS, ended=None)
    view = RunView(tmp_path / "a")
    assert view.refreshed() is view
    assert not view.ended
    (entry,) = RunLibrary([tmp_path]).scan()
    assert latest_by_camera([entry]) == [entry]


def test_the_playhead_stays_within_the_run_and_jumps_to_what_was_told(
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
    head.next_event(forth=False)
    assert head.run.times[head.number] == pytest.approx(times[-2])
    asked: list[str] = []
    head.listen(lambda: asked.append(head.panel), "Events")
    head.step(-1)
    assert asked == []
    head.open_panel("Events")
    assert asked == ["Events"]
    head.go(0)
    head.toggle()
    for _ in range(80):
        head.tick(0.1)
    assert (head.number, head.playing) == (59, False)
    head.toggle()
    assert (head.number, head.playing) == (0, True)


def test_a_run_of_a_camera_has_times_of_the_wall_and_begins_at_its_first_moment(
    run: tuple[Path, Sequence[Step]],
) -> None:
    view = RunView(run[0])
    assert view.now(view.seconds).startswith("0:")
    view.times = [t + 1800.0 for t in view.times]
    view.__dict__["clock"] = WallClock(((0.0, 1795455235.0), (view.start, 1795500000.0)))
    assert (view.share(view.start), view.share(view.seconds)) == (0.0, 1.0)
    assert view.when(view.start) == "06:00:00"
    assert view.when(0.0) == "11-23 17:33:55"  # of an alert that was open before
    assert view.now(view.start) == "2026-11-24 06:00:00 UTC"
    head = Playhead(view)
    head.go_to_share(0.5)
    assert head.number == pytest.approx(len(view.frames) / 2, abs=1)
    at = head.number
    head.pull(view.share(view.times[at]) + 0.002)  # less than to the next moment
    assert head.number == at + 1
    head.pull(1.0)
    assert head.number == len(view.frames) - 1
    head.pull(0.0)
    assert head.number == 0


def test_a_moment_that_cannot_be_read_does_not_take_the_timeline_away(tmp_path: Path) -> None:
    record(tmp_path / "a", meeting(), SETTINGS)
    whole = [t.label for t in RunView(tmp_path / "a").tracks]
    with closing(sqlite3.connect(tmp_path / "a" / JOURNAL)) as db:
        db.execute("UPDATE steps SET summary = '{' WHERE frame_index = 20")
        db.commit()
    view = RunView(tmp_path / "a")
    assert [t.label for t in view.tracks] == whole
    assert len(list(view.shares(1))) == len(view.frames) - 1
