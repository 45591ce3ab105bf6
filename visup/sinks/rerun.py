"""Frames and beliefs for the Rerun viewer; needs `visup[rerun]`."""

from __future__ import annotations

from typing import Any

import numpy as np

from visup.agent import Frame, Severity
from visup.agent.model.errors import ExtraMissingError
from visup.agent.model.step import Step

LEVELS = {Severity.INFO: "INFO", Severity.WARNING: "WARN", Severity.CRITICAL: "CRITICAL"}
JPEG_QUALITY = 80


class Rerun:
    """A sink for pairs of step and frame: writes to a file, or sends to a viewer.

    Args:
        place: A file (`run.rrd`), or the address of a viewer (`rerun+http://...`).

    Raises:
        ExtraMissingError: rerun-sdk is not installed.
    """

    def __init__(self, target: str) -> None:
        try:
            import rerun
        except ModuleNotFoundError as missing:
            raise ExtraMissingError("a sink for Rerun", "rerun") from missing
        self.name = f"rerun:{target}"
        self._rerun: Any = rerun
        self._stream: Any = rerun.RecordingStream("visup")
        if "://" in target:
            self._stream.connect_grpc(target)
        else:
            self._stream.save(target)

    def deliver(self, record: tuple[Step, Frame]) -> None:
        """Log one step."""
        step, frame = record
        rr, stream = self._rerun, self._stream
        stream.set_time("frame", sequence=step.frame_index)
        stream.set_time("time", duration=step.time)
        picture = rr.Image(frame.image, color_model="BGR").compress(jpeg_quality=JPEG_QUALITY)
        stream.log("camera", picture)
        stream.log("camera/objects", self._boxes(step))
        for event in step.events:
            stream.log("narrative", rr.TextLog(event.text, level=LEVELS[event.severity]))
        for report in step.reports:
            stream.log(f"behaviours/{report.behaviour}/ms", rr.Scalars(report.elapsed_ms))

    def close(self) -> None:
        """Flush."""
        self._stream.flush()
        self._stream.disconnect()

    def _boxes(self, step: Step) -> Any:
        present = step.mind.present()
        boxes = np.array([b.region.bbox for b in present], np.float32).reshape(-1, 4)
        return self._rerun.Boxes2D(
            array=boxes,
            array_format=self._rerun.Box2DFormat.XYWH,
            labels=[f"{b.id} {b.name} {b.strength:.2f}" for b in present],
            class_ids=[b.id for b in present],
        )
