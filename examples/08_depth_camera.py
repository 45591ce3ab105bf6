"""A depth camera beside the colour camera: measured depth in place of depth from size.

The camera is a stand-in: it makes a depth image for each frame. With a real one, open it in `start`
and read its latest image. `depth` percepts are used by everything that builds on them: relations
in depth, rules about depth.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from visup.agent import Contract, Depth, Directive, Frame, Observation, Percept
from visup.agent.cycle.agent import Agent
from visup.testing import crossing, stub_behaviours


class StandIn:
    """A camera that measures metres: bright things are near, and some pixels give no answer."""

    def image(self, frame: Frame) -> np.ma.MaskedArray[tuple[int, ...], np.dtype[np.float64]]:
        """(H, W) metres; masked where nothing came back."""
        grey: NDArray[np.float64] = frame.image.mean(axis=2)
        metres = np.where(grey > 150, 8.0 - grey / 50, 9.0)
        return np.ma.masked_array(
            metres, mask=(np.arange(metres.size) % 7 == 0).reshape(metres.shape)
        )


class DepthCamera:
    """Reports the depth of each region, under each name that it may have."""

    contract = Contract("depth_camera", gives=("depth",), needs=("region", "hypothesis"))

    def start(self) -> None:
        """Open the camera: where the behaviour runs, once."""
        self.camera = StandIn()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        """The median over the region's mask, with the spread of what was measured there."""
        metres = self.camera.image(frame)
        for region in observation.of("region"):
            x, y, w, h = region.bbox
            values = metres[y : y + h, x : x + w][region.mask].compressed()
            for name in {s.name for s in observation.of("hypothesis") if s.region_id == region.id}:
                depth = Depth(region.id, name, float(np.median(values)), float(values.std()))
                yield self.contract.percept(frame, depth)


if __name__ == "__main__":
    shots = crossing(10)
    agent = Agent([*stub_behaviours(("region", "hypothesis"), shots), DepthCamera()])
    for step in agent.steps(shot.frame for shot in shots):
        told = [f"region {d.region_id} at {d.depth:.1f} m" for d in step.observation.of("depth")]
        print(f"{step.time:4.2f} s  {', '.join(told)}")
