"""The process of a camera, begun by hand: it ends without its supervisor, and its run goes on in the next."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from tests.clips import moving_disc, write_clip
from visup.agent.storage.journal_reader import Recording
from visup.runs.checkpoints import read_checkpoint
from visup.runs.result import ExitCode
from visup.runs.settings import RunOptions, WatchSettings
from visup.serving.camera_process import watch_camera
from visup.serving.reports import CameraJob, CameraReport, ReportKind, ReportPipe, parse_report

OPTIONS = RunOptions(video=False, report=False, state_every_s=0.2)


class Listener:
    """What a process tells."""

    def __init__(self) -> None:
        self.read, self._write = os.pipe()
        self.pipe = ReportPipe(self._write)

    def heard(self) -> list[CameraReport]:
        os.close(self._write)
        with os.fdopen(self.read, "rb") as told:
            lines = told.read().splitlines()
        return [report for line in lines if (report := parse_report(line))]


def watched(job: CameraJob) -> tuple[int, list[CameraReport]]:
    listener = Listener()
    code = watch_camera(job, listener.pipe)
    return code, listener.heard()


def test_a_file_is_watched_and_its_outcome_reported(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(12))
    job = CameraJob(WatchSettings(str(clip)), OPTIONS, tmp_path / "run", resume=False)
    code, told = watched(job)
    assert code == 0
    kinds = [r.kind for r in told]
    assert (kinds[0], *set(kinds[1:-1]), kinds[-1]) == (
        ReportKind.OPENED,
        ReportKind.STEP,
        ReportKind.ENDED,
    )
    assert told[0].data == {"resumed": False}
    assert told[-1].data["steps"] == 12
    assert told[-1].data["live"] is False
    again, refused = watched(CameraJob(job.settings, OPTIONS, tmp_path / "run", resume=True))
    assert again == 2
    assert "this run is complete" in refused[-1].data["text"]
    assert Recording.open(tmp_path / "run").count() == 12


def test_a_refused_run_leaves_no_folder(tmp_path: Path) -> None:
    job = CameraJob(WatchSettings("none.avi"), OPTIONS, tmp_path / "run", resume=False)
    code, told = watched(job)
    assert code == 2
    assert told[-1].kind is ReportKind.REFUSED
    assert told[-1].data["source"] is True
    assert list(tmp_path.iterdir()) == []


def wait_for(what: Callable[[], object], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not come in time"
        time.sleep(0.02)


def read_by_a_new_process(run: Path) -> str:
    """Why the state cannot be taken up where nothing is loaded yet, or 'None'."""
    code = (
        "import sys; from pathlib import Path; from visup.runs.checkpoints import read_checkpoint;"
        "print(read_checkpoint(Path(sys.argv[1]))[1])"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, str(run)], capture_output=True, text=True, check=True
    )
    return told.stdout.strip()


def test_it_ends_without_its_supervisor_and_its_run_can_be_resumed(tmp_path: Path) -> None:
    from visup.serving.camera_child import CameraChild

    clip = write_clip(tmp_path / "disc.avi", moving_disc(40), fps=20.0)
    settings = WatchSettings(f"loop:{clip}")
    told: list[CameraReport] = []
    child = CameraChild(CameraJob(settings, OPTIONS, tmp_path / "run", resume=False))
    wait_for(lambda: (tmp_path / "run" / "state.bin").is_file())
    child.close_stdin()
    wait_for(lambda: child.exit_code() is not None)
    told += child.reports()
    child.close()
    assert child.exit_code() in (ExitCode.STOPPED, ExitCode.BAD)  # a busy machine drops frames
    assert told[-1].kind is ReportKind.ENDED
    assert told[-1].data["stopped"] is True
    before = Recording.open(tmp_path / "run").count()
    (_, last) = Recording.open(tmp_path / "run").first_and_last() or (0, 0)
    kept, _ = read_checkpoint(tmp_path / "run")
    assert kept
    assert kept.frame_index == last  # the state after the last step was kept, too
    assert read_by_a_new_process(tmp_path / "run") == "None"

    def stop_once_it_watches() -> None:
        wait_for(lambda: Recording.open(tmp_path / "run").count() > before)
        os.kill(os.getpid(), signal.SIGTERM)

    later = threading.Thread(target=stop_once_it_watches)
    later.start()
    _, told = watched(CameraJob(settings, OPTIONS, tmp_path / "run", resume=True))
    later.join()
    assert told[0].data == {"resumed": True}
    assert Recording.open(tmp_path / "run").count() > before
    assert Recording.open(tmp_path / "run").facts()["ended"] == "stopped"
