"""The health behaviour: image faults that must not be taken for motion (dark, frozen, noisy, ...).

The tests are conservative. A black sky with stars is not dark, a nearly still scene with sensor noise is not
frozen, a white cloud is not saturation: each fault must fill the image, or appear between two frames as
nothing in a scene does, and it must last.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from visup.agent import (
    Contract,
    Directive,
    Frame,
    Health,
    HealthStatus,
    Observation,
    Percept,
)
from visup.agent.contract.saving import saved_attributes
from visup.percepts.health.frame_timing import ArrivalMonitor
from visup.percepts.health.frozen_under_noise import NoiseOnlyDetector
from visup.percepts.health.image_quality import ImageQuality, measure_quality
from visup.percepts.health.repeated_frames import RepeatDetector
from visup.percepts.health.settings import HealthSettings
from visup.percepts.health.standstill import StandstillDetector

OK = Health(HealthStatus.OK)
REFERENCE_IMAGES = 25  # number of sound images that define what is usual
FEWEST_REFERENCES = 4
SUSPECTED_CONFIDENCE = 0.5


class HealthBehaviour:
    """Reports the state of the camera's image for every frame.

    Args:
        settings: Thresholds.
    """

    contract = Contract("health", gives=("health",))

    def __init__(self, settings: HealthSettings | None = None) -> None:
        self._settings = settings or HealthSettings()
        self._usual: deque[ImageQuality] = deque(maxlen=REFERENCE_IMAGES)
        self._standstill = StandstillDetector(self._settings.covered)
        self._arrivals = ArrivalMonitor(
            self._settings.lost, self._settings.gap, self._settings.same_s
        )
        self._repeats = RepeatDetector()
        self._noise_only = NoiseOnlyDetector()
        self._same_since: float | None = None
        self._fault_since: float | None = None
        self._faulty = False

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        return saved_attributes(self, "_settings")

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        vars(self).update(state)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the health of one frame; one percept of kind 'health'.

        Its confidence is below 1 while a fault has not lasted long enough to be reported; such a frame
        should not be learned from.
        """
        health = self._assess(frame)
        suspected = health is OK and self._fault_since is not None
        confidence = SUSPECTED_CONFIDENCE if suspected else 1.0
        return [Percept("health", health, frame.time, self.contract.name, confidence)]

    def _assess(self, frame: Frame) -> Health:
        quality = measure_quality(frame.image)
        repeat = self._repeats.compare(frame.image, quality.small)
        # A dark image repeats itself too, without missing frames.
        usable = None if self._faulty else repeat
        missing = self._arrivals.arrive(frame.index, frame.time, usable)
        frozen = self._frozen(frame.time, repeat.same)
        health = _image_health(quality, self._usual, self._settings)
        self._faulty = health is not OK
        noise_alone = False
        if not self._faulty:
            health = self._cell_health(quality, frame.time)
            noise_alone = self._noise_only.update(quality, frame.time)
            if self._standstill.standstill is None:
                self._usual.append(quality)
        else:
            self._standstill.reset()
            self._noise_only.reset()
        health = self._if_lasting(health, frame.time)
        if health is OK and noise_alone:
            return Health(HealthStatus.FROZEN, "Nothing changes any more but noise.")
        if health is OK and frozen:
            return Health(HealthStatus.FROZEN, "The image does not change at all.")
        if health is OK and missing:
            return Health(HealthStatus.DROPPED, f"About {missing} frames are missing.")
        return health

    def _cell_health(self, quality: ImageQuality, now: float) -> Health:
        halt = self._standstill.update(quality.small, quality.factor, now)
        if halt is None:
            return OK
        if halt.whole:
            return Health(HealthStatus.FROZEN, "All that moved stands still since one moment.")
        return Health(HealthStatus.BLOCKED, "A large part of the view is covered.")

    def _if_lasting(self, health: Health, now: float) -> Health:
        """Report only faults that last, but recovery at once."""
        if health is OK:
            self._fault_since = None
            return health
        self._fault_since = now if self._fault_since is None else self._fault_since
        return health if now - self._fault_since >= self._settings.lasting_s else OK

    def _frozen(self, now: float, same: bool) -> bool:
        """Whether a source that changed before has repeated one image for long enough."""
        if not same:
            self._same_since = None
            return False
        self._same_since = now if self._same_since is None else self._same_since
        return now - self._same_since >= self._settings.same_s


def _image_health(
    quality: ImageQuality, usual: Sequence[ImageQuality], settings: HealthSettings
) -> Health:
    """The health of one image, compared with what is usual."""
    known = len(usual) >= FEWEST_REFERENCES
    if _dark(quality, usual, settings, known):
        return Health(HealthStatus.DARK, "The image is dark.")
    if _saturated(quality, usual, settings, known):
        return Health(HealthStatus.SATURATED, "The image is saturated.")
    if known and quality.spread < settings.flat and _largest(usual, "spread") > 4 * settings.flat:
        return Health(HealthStatus.BLOCKED, "The whole view is covered.")
    # Noise has no straight steps, but small blocks have as many impulses as noise.
    if _broken(quality, usual, settings, known):
        return Health(HealthStatus.SCRAMBLED, "The image is broken into blocks.")
    if _noisy(quality, usual, settings, known):
        return Health(HealthStatus.NOISY, "The image is noisy.")
    return OK


def _largest(usual: Sequence[ImageQuality], name: str) -> float:
    return max((float(getattr(p, name)) for p in usual), default=0.0)


def _dark(
    p: ImageQuality, usual: Sequence[ImageQuality], settings: HealthSettings, known: bool
) -> bool:
    if p.high < settings.dark:
        return True
    sudden = known and p.high < 0.25 * min(u.high for u in usual)
    return sudden and p.high < 2 * settings.dark


def _saturated(
    p: ImageQuality, usual: Sequence[ImageQuality], settings: HealthSettings, known: bool
) -> bool:
    if p.low > settings.bright:
        return True
    sudden = known and p.low > 30 + _largest(usual, "low")
    return sudden and p.low > settings.bright - 30 and p.spread < 2 * settings.flat


def _noisy(
    p: ImageQuality, usual: Sequence[ImageQuality], settings: HealthSettings, known: bool
) -> bool:
    if p.noise > settings.noisy or p.impulses > settings.impulses:
        return True
    if not known:
        return False
    grain = p.noise > max(settings.rather_noisy, 3.0 * _largest(usual, "noise"))
    specks = p.impulses > max(settings.rather_impulses, 3.0 * _largest(usual, "impulses"))
    return grain or specks


def _broken(
    p: ImageQuality, usual: Sequence[ImageQuality], settings: HealthSettings, known: bool
) -> bool:
    if p.steps > settings.broken:
        return True
    return known and p.steps > settings.rather_broken + 1.7 * _largest(usual, "steps")
