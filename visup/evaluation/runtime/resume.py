"""Kills runs at random moments, resumes them, and compares them with an uninterrupted one.

Each run is a separate process that gets SIGKILL, without cleanup. A quarter of the resumed runs are killed
again; a third save no states and process all frames again.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from visup.agent.model.errors import OutputError, SettingsError, VisupError
from visup.agent.storage.journal_reader import JOURNAL, Recording, event_text
from visup.evaluation.figures import Progress, silent, sums_of
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, supervise
from visup.runs.settings import RunOptions, WatchSettings
from visup.terminal.console import make_console
from visup.terminal.narrator import Narrator

SECOND_KILL_PROBABILITY = 0.25
STATELESS_PROBABILITY = 1 / 3
STATE_EVERY_S = 0.4
MAX_RESUMES = 20
MAX_START_S = 60.0
SIZE, FRAMES, FPS = (96, 72), 50, 10.0


def evaluate_resume(
    settings: WatchSettings | None = None,
    *,
    kills: int = 200,
    seed: int = 0,
    state_every_s: float = STATE_EVERY_S,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Kill runs and resume them.

    Args:
        settings: Settings of the run; by default a synthetic clip of two crossing squares.
        kills: Number of runs to kill.
        seed: Random seed.
        state_every_s: Seconds between states, in runs that save them.
        progress: Shows what is being done.

    Returns:
        `items` 'with states' and 'without', each with `kills`, `early` (killed before anything was
        recorded, and nothing had been printed), `resumed` (times, some more than once), `equal` (runs
        whose events, verdict and beliefs at each frame equal the unbroken run's), `lost` (printed events
        that the journal lacks) and `resume_s` (median time until the run went on and ended); `failures`
        names what differs.

    Raises:
        SettingsError: This system has no processes that can be forked and killed.
    """
    if not hasattr(os, "fork"):
        raise SettingsError("runs can only be killed where processes can be forked")
    rng = np.random.default_rng(seed)
    counts: dict[str, _ResumeCounts] = {"with states": _ResumeCounts(), "without": _ResumeCounts()}
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        settings = settings or WatchSettings(source=str(crossing(folder / "clip.avi", seed)))
        unbroken = _unbroken_run(settings, folder / "whole", state_every_s)
        for trial in range(kills):
            progress(f"{trial} of {kills} runs killed")
            stateless = rng.random() < STATELESS_PROBABILITY
            every = 0.0 if stateless else state_every_s
            group = counts["without" if stateless else "with states"]
            differences = _trial(unbroken, folder / f"{trial}", every, rng, group)
            failures += [f"run {trial}: {text}" for text in differences]
    items = {name: t.figures() for name, t in counts.items() if t.kills}
    total = sums_of(list(items.values()), ("kills", "early", "equal", "lost"))
    return {"items": items, "total": {**total, "whole_s": unbroken.seconds}, "failures": failures}


def crossing(path: Path, seed: int) -> Path:
    """A short clip of two textured squares crossing a textured background, with sensor noise."""
    import cv2

    rng = np.random.default_rng(seed)
    width, height = SIZE
    background = cv2.GaussianBlur(
        rng.integers(0, 255, (height, width, 3)).astype(np.uint8), (0, 0), 1.5
    )
    squares = [
        cv2.GaussianBlur(rng.integers(0, 255, (26, 26, 3)).astype(np.uint8), (0, 0), 1.2)
        for _ in range(2)
    ]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), FPS, SIZE)
    for i in range(FRAMES):
        image = background + rng.normal(0.0, 1.5, background.shape)
        for square, x, y in ((squares[0], int(1.6 * i), 8), (squares[1], 70 - int(1.6 * i), 40)):
            x = int(np.clip(x, 0, width - 26))
            image[y : y + 26, x : x + 26] = square
        writer.write(np.clip(image, 0, 255).astype(np.uint8))
    writer.release()
    return path


class _ResumeCounts:
    def __init__(self) -> None:
        self.kills = self.early = self.resumed = self.equal = self.lost = 0
        self.seconds: list[float] = []

    def figures(self) -> dict[str, Any]:
        names = ("kills", "early", "resumed", "equal", "lost")
        figures: dict[str, Any] = {n: getattr(self, n) for n in names}
        return {**figures, "resume_s": float(np.median(self.seconds or [0.0]))}


@dataclass(frozen=True, slots=True)
class _UnbrokenRun:
    """The uninterrupted reference run: its settings, duration and outcome."""

    settings: WatchSettings
    seconds: float
    outcome: object


def _unbroken_run(settings: WatchSettings, folder: Path, every: float) -> _UnbrokenRun:
    child = _start_run(settings, folder, every)
    begin = time.perf_counter()
    _wait(child)
    return _UnbrokenRun(settings, time.perf_counter() - begin, _outcome(folder))


def _trial(
    unbroken: _UnbrokenRun,
    folder: Path,
    every: float,
    rng: np.random.Generator,
    counts: _ResumeCounts,
) -> Sequence[str]:
    """Kill one run and resume it to its end; returns the differences."""
    counts.kills += 1
    _kill(_start_run(unbroken.settings, folder, every), float(rng.uniform(0.0, unbroken.seconds)))
    if not _has_recording(folder):
        counts.early += 1
        counts.equal += not _printed(folder)
        return ["nothing was recorded, but events were printed"] if _printed(folder) else []
    missing = _missing(folder)
    for _ in range(MAX_RESUMES):
        begin = time.perf_counter()
        child = _resume(folder, every)
        if child is None:
            break
        counts.resumed += 1
        if rng.random() < SECOND_KILL_PROBABILITY:
            _kill(child, float(rng.uniform(0.0, unbroken.seconds)))
        else:
            _wait(child)
            counts.seconds.append(time.perf_counter() - begin)
        missing += _missing(folder)
    counts.lost += missing
    equal = _outcome(folder) == unbroken.outcome
    counts.equal += equal
    differences = [] if equal else ["another outcome than the unbroken run's"]
    return [*differences, *([f"{missing} printed events are missing"] if missing else [])]


def _start_run(settings: WatchSettings, folder: Path, every: float) -> int:
    """Start a run in a process; returns after recording has begun."""
    folder.mkdir()
    child = _fork(folder, lambda console: _supervise(settings, folder, every, console, False))
    deadline = time.monotonic() + MAX_START_S
    while not (folder / JOURNAL).exists() and time.monotonic() < deadline:
        time.sleep(0.005)
    return child


def _resume(folder: Path, every: float) -> int | None:
    """Resume a run in a process, or return None if the run has ended."""
    try:
        interrupted = interrupted_run(folder)
    except OutputError:
        return None
    return _fork(
        folder, lambda console: _supervise(interrupted.settings, folder, every, console, True)
    )


def _supervise(
    settings: WatchSettings, folder: Path, every: float, console: Console, resume: bool
) -> None:
    interrupted = interrupted_run(folder) if resume else None
    options = RunOptions(video=False, report=False, state_every_s=every)
    audience = Audience([Narrator(console, True)])
    supervise(settings, folder, audience=audience, options=options, past=interrupted)


def _fork(folder: Path, run: Callable[[Console], None]) -> int:
    """Run a function in a child process with redirected output; returns its process id."""
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        out = os.open(folder / "printed", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(out, 1)
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115  # of this process only
        run(make_console())
        sys.stdout.flush()
        code = 0
    except VisupError as error:
        os.write(2, f"{error}\n".encode())
    finally:
        os._exit(code)


def _kill(child: int, after_s: float) -> None:
    time.sleep(after_s)
    with suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _wait(child: int) -> None:
    _, status = os.waitpid(child, 0)
    if status:
        raise OutputError("a run that was not killed failed")


def _has_recording(folder: Path) -> bool:
    """Whether anything was recorded before the kill."""
    try:
        return "settings" in Recording.open(folder).facts()
    except OutputError:
        return False


def _printed(folder: Path) -> list[str]:
    """Completely printed events."""
    path = folder / "printed"
    lines = path.read_text().split("\n")[:-1] if path.exists() else []
    return [event_text(json.loads(line)) for line in lines]


def _missing(folder: Path) -> int:
    recorded = {event_text(e) for e in Recording.open(folder).events()}
    return sum(line not in recorded for line in _printed(folder))


def _outcome(folder: Path) -> object:
    """Events, verdict, alerts, and observations and beliefs at each frame."""
    recording = Recording.open(folder / JOURNAL)
    facts = recording.facts()
    return (
        (folder / "events.jsonl").read_bytes(),
        (facts["verdict"], facts["steps"], facts["ended"]),
        recording.alerts(),
        list(recording.summaries()),
    )
