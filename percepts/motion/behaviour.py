"""The segmenter as a behaviour: one percept for each region that moves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from visup.agent import Contract, Directive, Frame, HealthStatus, Observation, Percept
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.percepts.motion.settings import MotionSettings


class MotionBehaviour:
    """Reports regions; nothing while the camera's image is not to be trusted.

    Args:
        settings: What can be set about seeing motion.
    """

    contract = Contract("motion", gives=("region",))

    def __init__(self, settings: MotionSettings | None = None) -> None:
        self._segmenter = MotionSegmenter(settings)

    def perceive(
        self, frame: Frame, seen: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the regions of one frame.

        Args:
            frame: The next frame.
            seen: What was reported before of this frame; unless its health is OK, nothing moves.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            Percepts of kind 'region', by id.
        """
        if any(health.status is not HealthStatus.OK for health in seen.of("health")):
            return []
        regions = self._segmenter.step(frame, directives)
        return [Percept("region", r, frame.time, self.contract.name, r.confidence) for r in regions]
