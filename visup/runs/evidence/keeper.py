"""Saves evidence of the alerts of a run in the folder `evidence` next to its journal.

An alert has a picture at once, `alert-ID.jpg`, for those who are notified; its clip follows some seconds
later under a name known from the beginning. Alerts that open during a clip share it. `alert-ID.json` names
the files of an alert.
"""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from pathlib import Path
from typing import Any

from visup.agent import Alert, AlertCondition, Frame, Severity
from visup.agent.cycle.system_alerts import NOT_RECORDED
from visup.agent.execution.runners import error_line
from visup.agent.model.step import Step
from visup.agent.storage.atomic import write_atomically
from visup.agent.storage.jsonable import to_jsonable
from visup.agent.storage.text_file import read_text_file
from visup.agent.storage.wall_clock import RecordStamp
from visup.report.annotate import annotate
from visup.runs.evidence.clip_spool import SUFFIX, ClipSpool, encode_clip
from visup.runs.evidence.frame_ring import EncodedFrame, FrameEncoder, FrameRing, jpeg_of
from visup.runs.settings import EvidenceOptions

EVIDENCE = "evidence"
LONGEST_CLIP_S = 120.0
"""Limit of a clip that further alerts extend; the next alert begins a new one."""

SNAPSHOT_QUALITY = 90
FREE_SPACE_CHECK_S = 30.0
"""Seconds between checks of the free disk space; also the least duration of an alert about it."""
KEYS = ("snapshot", "clip")


class _FreeSpace:
    """Free space on the disk of a folder, checked at intervals.

    Args:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._checked_at, self._free = folder, -FREE_SPACE_CHECK_S, math.inf

    def free(self) -> float:
        """Free bytes."""
        now = time.monotonic()
        if now - self._checked_at >= FREE_SPACE_CHECK_S:
            self._checked_at = now
            with suppress(OSError):
                self._free = float(shutil.disk_usage(self._folder).free)
        return self._free


def _not_recorded(key: str, cause: str, evidence: str) -> AlertCondition:
    return AlertCondition(NOT_RECORDED, (), Severity.WARNING, cause, (evidence,), key=key, needs=())


class EvidenceKeeper:
    """An observer that saves a picture and a clip of each alert.

    Args:
        folder: Folder of the run.
        options: Length of clips, and memory for frames before an alert.
        fps: Processed frames per second.
        stamp: Camera, host, and wall-clock time.
    """

    def __init__(
        self, folder: Path, options: EvidenceOptions, fps: float, stamp: RecordStamp | None = None
    ) -> None:
        self._folder = folder / EVIDENCE
        self._options, self._fps, self._stamp = options, fps, stamp or RecordStamp()
        self._ring = FrameRing(options.before_s, int(options.memory_mb * 2**20))
        self._encode = FrameEncoder()
        self._clip: ClipSpool | None = None
        self._clip_start = self._clip_end = 0.0
        self._links: dict[int, Mapping[str, str]] = {}
        self._fault = ""
        self._unwritten: list[Path] = []
        self._free_space = _FreeSpace(folder)
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="evidence")
        self._writing: list[Any] = []
        for spool in sorted(folder.parent.glob(f"*/{EVIDENCE}/*{SUFFIX}")):
            self._write_later(spool)  # left by a killed process

    def __call__(self, step: Step, frame: Frame) -> None:
        """Buffer the frame, and save evidence of the alerts that open."""
        encoded = self._encode(frame.image, step.time)
        self._guarded(lambda: self._extend_clip(encoded))
        opened = [a for a in step.alerts if a.closed is None]
        if opened:
            self._guarded(lambda: self._save_evidence(opened, step, frame, encoded))
        self._ring.add(encoded)

    def links(self, alert: Alert) -> Mapping[str, str]:
        """Links to the evidence of an alert: `snapshot`, `clip`; empty if there is none."""
        found = self._links.get(alert.id)
        if found is None:
            found = self._existing_record(alert)
        if alert.closed is not None:
            self._links.pop(alert.id, None)
        return found

    def runtime_faults(self) -> Iterable[AlertCondition]:
        """The fault that evidence cannot be saved, while it lasts."""
        if self._fault:
            cause = "Pictures and clips of alerts cannot be saved; supervision goes on."
            yield _not_recorded(EVIDENCE, cause, self._fault)
        least = self._options.least_free_bytes
        if least and self._free_space.free() < least:
            cause = "The disk is nearly full; the oldest pictures and clips of alerts are deleted."
            left = f"{self._free_space.free() / 1e9:.1f} GB are left; the minimum is {least / 1e9:.1f} GB."
            yield _not_recorded("room", cause, left)

    def move_to(self, folder: Path) -> None:
        """Continue in the folder of another journal."""
        self._end_clip()
        self._folder = folder / EVIDENCE

    def close(self, wait_s: float = 10.0) -> None:
        """End the clip; unfinished files are left to the process that resumes the run.

        Args:
            wait_s: Time limit for the last clips, seconds.
        """
        self._end_clip()
        wait(self._writing, timeout=wait_s)
        self._worker.shutdown(wait=False, cancel_futures=True)

    def _guarded(self, act: Callable[[], None]) -> None:
        """Run an action; its errors are reported, since losing evidence must not stop the supervision."""
        try:
            act()
        except Exception as fault:
            self._fault = error_line(fault)
            self._end_clip()

    def _extend_clip(self, encoded: EncodedFrame) -> None:
        if self._clip:
            self._clip.add(encoded)
            if encoded.time >= self._clip_end:
                self._end_clip()

    def _save_evidence(
        self, opened: Sequence[Alert], step: Step, frame: Frame, encoded: EncodedFrame
    ) -> None:
        first = f"alert-{opened[0].id}"
        self._folder.mkdir(exist_ok=True)
        picture = jpeg_of(annotate(frame.image, step.mind), SNAPSHOT_QUALITY)
        write_atomically(self._folder / f"{first}.jpg", picture)
        self._clip_for(first, encoded)
        assert self._clip
        names = {"snapshot": f"{first}.jpg", "clip": f"{self._clip.path.stem}.webm"}
        for alert in opened:
            record = {**to_jsonable(alert), **self._stamp.of(alert.opened), **names}
            write_atomically(
                self._folder / f"alert-{alert.id}.json", json.dumps(record).encode() + b"\n"
            )
            self._links[alert.id] = {key: self._link(name) for key, name in names.items()}
        self._fault = ""

    def _clip_for(self, name: str, encoded: EncodedFrame) -> None:
        """Begin a clip with the buffered frames, or extend the present one."""
        if self._clip and encoded.time - self._clip_start > LONGEST_CLIP_S:
            self._end_clip()
        if self._clip is None:
            path = self._folder / f"{name}{SUFFIX}"
            path.unlink(missing_ok=True)
            self._clip, self._clip_start = ClipSpool(path), encoded.time
            for before in (*self._ring, encoded):
                self._clip.add(before)
        self._clip_end = encoded.time + self._options.after_s

    def _end_clip(self) -> None:
        clip, self._clip = self._clip, None
        if clip:
            with suppress(OSError):
                clip.close()
            self._write_later(clip.path)

    def _write_later(self, spool: Path) -> None:
        self._writing = [w for w in self._writing if not w.done()]
        unwritten, self._unwritten = self._unwritten, []
        for each in (*unwritten, spool):
            with suppress(RuntimeError):  # no memory for a thread: the next process does it
                self._writing.append(self._worker.submit(self._write, each))

    def _write(self, spool: Path) -> None:
        try:
            encode_clip(spool, spool.with_suffix(".webm"), self._fps)
        except FileNotFoundError:
            return  # deleted meanwhile to free space
        except Exception as fault:
            self._fault = error_line(fault)
            self._unwritten.append(spool)

    def _link(self, name: str) -> str:
        path = self._folder / name
        base = self._options.link
        return str(path) if base is None else f"{base}/{path.parent.parent.name}/{EVIDENCE}/{name}"

    def _existing_record(self, alert: Alert) -> Mapping[str, str]:
        """The record of an earlier process."""
        try:
            record = json.loads(read_text_file(self._folder / f"alert-{alert.id}.json"))
            return {key: self._link(Path(str(record[key])).name) for key in KEYS}
        except (OSError, ValueError, KeyError, TypeError):
            return {}
