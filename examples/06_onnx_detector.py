"""An object detector from an ONNX file: detections of a network become percepts (`visup[onnx]`).

The network is made here, of one layer, so that the example needs no download: it averages blocks of
16 x 16 pixels. Put your own detector in its place; the behaviour stays the same.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import onnxruntime
from onnx import TensorProto, helper, save
from pydantic import BaseModel, Field

from visup.agent import Contract, Directive, Frame, Observation, Percept
from visup.agent.cycle.agent import Agent
from visup.testing import crossing


class Detector:
    """Reports (x, y, width, height) of blocks that the network finds bright, pixels."""

    contract = Contract("detector", gives=("detection",), cost_ms=50)

    class Settings(BaseModel):
        """Which network, and what counts."""

        model: Path
        score: float = Field(default=0.7, ge=0, le=1)

    def __init__(self, settings: Settings) -> None:
        self.settings = settings

    def start(self) -> None:
        """A session cannot be sent to another process: it is opened where the behaviour runs."""
        self.session = onnxruntime.InferenceSession(str(self.settings.model))

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """One percept for each block above the least score, which becomes its confidence."""
        grey = frame.image.mean(axis=2, dtype=np.float32)[None, None] / 255
        (scores,) = self.session.run(None, {"image": grey})
        for row, column in np.argwhere(scores[0, 0] > self.settings.score).tolist():
            sure = min(float(scores[0, 0, row, column]), 1.0)
            yield self.contract.percept(frame, (column * 16, row * 16, 16, 16), confidence=sure)


def tiny_network(path: Path) -> None:
    layer = helper.make_node(
        "AveragePool", ["image"], ["scores"], kernel_shape=[16, 16], strides=[16, 16]
    )
    ends = [
        helper.make_tensor_value_info(n, TensorProto.FLOAT, [1, 1, None, None])
        for n in ("image", "scores")
    ]
    graph = helper.make_graph([layer], "tiny", ends[:1], ends[1:])
    save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8), path)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        tiny_network(Path(folder) / "tiny.onnx")
        detector = Detector(Detector.Settings(model=Path(folder) / "tiny.onnx"))
        for step in Agent([detector]).steps(shot.frame for shot in crossing(10)):
            found = step.observation.of("detection")
            print(f"{step.time:4.2f} s  {len(found)} detections, the first at {found[:1]}")
