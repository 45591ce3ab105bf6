"""Motion segmentation as a behaviour: one percept for each moving region."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from visup.agent import Contract, Directive, Frame, HealthStatus, Observation, Percept
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.output.backward_tracking import BackwardTracker
from visup.percepts.motion.segmenter import MotionSegmenter

HARMED = frozenset(HealthStatus) - {HealthStatus.OK, HealthStatus.DROPPED}
"""Faults of the image itself; when frames are dropped, those that arrive are sound."""


def image_is_sound(observation: Observation) -> bool:
    """Whether no reported health fault affects the image itself."""
    return all(p.confidence >= 1.0 and p.value.status not in HARMED for p in _health(observation))


def image_is_trusted(observation: Observation) -> bool:
    """Whether motion may be reported: the frame's health is OK or was not checked."""
    return all(p.value.status is HealthStatus.OK for p in _health(observation))


def _health(observation: Observation) -> list[Percept]:
    return [p for r in observation.reports for p in r.percepts if p.kind == "health"]


class MotionBehaviour:
    """Reports moving regions; nothing while the image cannot be trusted.

    Args:
        settings: Settings of the segmenter.
    """

    contract = Contract("motion", gives=("region",), hang_s=COMPILING_HANG_S)

    def __init__(self, settings: MotionSettings | None = None) -> None:
        self._segmenter = MotionSegmenter(settings)
        self._backward = BackwardTracker()

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        return {"segmenter": self._segmenter.save(), "back": self._backward}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        self._segmenter.load(state["segmenter"])
        self._backward = state["back"]

    def missed(self, observation: Observation) -> None:
        """Reserve the ids of regions reported since the restored state."""
        for region in observation.of("region"):
            self._segmenter.reserve_id(region.id)

    def new_id(self) -> int:
        """An id that no region of this video has had or will have."""
        return self._segmenter.new_id()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the regions of one frame.

        Args:
            frame: The next frame.
            observation: What was reported for this frame so far; no motion is reported unless its health is
                fully OK.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            Percepts of kind 'region', by id.
        """
        # Tracks survive skipped frames, but not black frames taken for a real view.
        if not image_is_sound(observation):
            return []
        regions = self._backward.step(frame, self._segmenter.step(frame, directives))
        if not image_is_trusted(observation):
            return []
        return [Percept("region", r, frame.time, self.contract.name, r.confidence) for r in regions]
