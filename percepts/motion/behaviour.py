"""The segmenter as a behaviour: one percept for each region that moves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from visup.agent import Contract, Directive, Frame, HealthStatus, Observation, Percept
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.output.backward_tracking import BackwardTracker
from visup.percepts.motion.segmenter import MotionSegmenter

HARMED = frozenset(HealthStatus) - {HealthStatus.OK, HealthStatus.DROPPED}
"""Faults of the image itself; where frames are missing, those that come are sound."""


def image_is_sound(observation: Observation) -> bool:
    """Whether a frame shows what there is, as far as its health was looked at."""
    return all(p.confidence >= 1.0 and p.value.status not in HARMED for p in _health(observation))


def image_is_trusted(observation: Observation) -> bool:
    """Whether what moves in a frame may be told: its health is OK, or nobody looked at it."""
    return all(p.value.status is HealthStatus.OK for p in _health(observation))


def _health(observation: Observation) -> list[Percept]:
    return [p for r in observation.reports for p in r.percepts if p.kind == "health"]


class MotionBehaviour:
    """Reports regions; nothing while the camera's image is not to be trusted.

    Args:
        settings: What can be set about seeing motion.
    """

    contract = Contract("motion", gives=("region",), hang_s=COMPILING_HANG_S)

    def __init__(self, settings: MotionSettings | None = None) -> None:
        self._segmenter = MotionSegmenter(settings)
        self._backward = BackwardTracker()

    def save(self) -> Mapping[str, Any]:
        """All that is remembered of the frames so far; see `visup.agent.storage.checkpoint`."""
        return {"segmenter": self._segmenter.save(), "back": self._backward}

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on what a behaviour of the same settings remembered."""
        self._segmenter.load(state["segmenter"])
        self._backward = state["back"]

    def missed(self, observation: Observation) -> None:
        """Take note of regions reported since the state that was taken on: their ids are used."""
        for region in observation.of("region"):
            self._segmenter.used(region.id)

    def new_id(self) -> int:
        """An id that no region of this video has had, nor will have."""
        return self._segmenter.new_id()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the regions of one frame.

        Args:
            frame: The next frame.
            observation: What was reported before of this frame; unless its health is OK beyond doubt,
                nothing moves.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            Percepts of kind 'region', by id.
        """
        # Tracks live on over frames that are left out, but not over black ones taken for sight.
        if not image_is_sound(observation):
            return []
        regions = self._backward.step(frame, self._segmenter.step(frame, directives))
        if not image_is_trusted(observation):
            return []
        return [Percept("region", r, frame.time, self.contract.name, r.confidence) for r in regions]
