"""Health of the camera's image: what must never be taken for motion (dark, frozen, noisy, ...).

The tests are conservative. A black sky with stars is not dark, a nearly still scene with sensor
noise is not frozen, a white cloud is not saturation: each fault must fill the image, and must last.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Contract,
    Directive,
    Frame,
    Health,
    HealthStatus,
    Observation,
    Percept,
)

LINES = 64  # about how many lines of the image are looked at for broken blocks
BLOCK = 16
Grey = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class HealthSettings:
    """Thresholds of `HealthBehaviour`.

    Attributes:
        dark: Grey level that hardly anything of a dark image exceeds.
        bright: Grey level that nearly all of a saturated image exceeds.
        noisy: Standard deviation of pixel noise, grey levels, from which it is noisy.
        blocked: Share of the image that must be flat and without change to be blocked.
        scrambled: How much steeper steps at a block grid must be than elsewhere.
        lasting_s: How long a fault must last before it is reported, seconds.
        frozen_s: How long an image must be the very same before it is called frozen, seconds.
    """

    dark: float = 14.0
    bright: float = 245.0
    noisy: float = 22.0
    blocked: float = 0.4
    scrambled: float = 3.0
    lasting_s: float = 0.3
    frozen_s: float = 0.8


class HealthBehaviour:
    """Reports the state of the camera's image for every frame.

    Args:
        settings: Thresholds.
    """

    contract = Contract("health", gives=("health",))

    def __init__(self, settings: HealthSettings | None = None) -> None:
        self._settings = settings or HealthSettings()
        self._last: NDArray[np.uint8] | None = None
        self._same_since: float | None = None
        self._was_lively = False
        self._detail = 0.0
        self._fault = HealthStatus.OK
        self._fault_since = 0.0

    def perceive(
        self, frame: Frame, seen: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the health of one frame; one percept of kind 'health'."""
        health = self._lasting(self._judge(frame), frame.time)
        return [Percept("health", health, frame.time, self.contract.name)]

    def _judge(self, frame: Frame) -> Health:
        grey = _grey(frame)
        frozen = self._frozen(frame)
        for health in (
            _exposure(grey, self._settings),
            frozen,
            _noise(grey, self._settings),
            _scrambled(grey, self._settings),
            self._blocked(grey),
        ):
            if health.status is not HealthStatus.OK:
                return health
        return Health(HealthStatus.OK)

    def _lasting(self, health: Health, now: float) -> Health:
        """Only faults that last are told; recovery is told at once."""
        if health.status is not self._fault:
            self._fault, self._fault_since = health.status, now
        if health.status in (HealthStatus.OK, HealthStatus.FROZEN):
            return health
        lasted = now - self._fault_since >= self._settings.lasting_s
        return health if lasted else Health(HealthStatus.OK)

    def _frozen(self, frame: Frame) -> Health:
        """The very same image again and again from a source that did change before."""
        same = (
            self._last is not None
            and self._last.shape == frame.image.shape
            and bool(np.array_equal(self._last, frame.image))
        )
        changed = self._last is not None and not same
        self._was_lively = self._was_lively or changed
        self._last = frame.image
        if not same:
            self._same_since = None
            return Health(HealthStatus.OK)
        self._same_since = frame.time if self._same_since is None else self._same_since
        lasted = frame.time - self._same_since >= self._settings.frozen_s
        if lasted and self._was_lively:
            return Health(HealthStatus.FROZEN, "The image does not change at all.")
        return Health(HealthStatus.OK)

    def _blocked(self, grey: Grey) -> Health:
        """A large share of an image that had detail has become one flat tone cut off straight."""
        flat = _flat_share(grey)
        usual = self._detail
        health = Health(HealthStatus.OK)
        if usual > 0 and (1 - flat) < (1 - self._settings.blocked) * usual and flat > 0.5:
            return Health(HealthStatus.BLOCKED, "A large part of the view has become flat.")
        self._detail = (1 - flat) if usual == 0 else usual + 0.02 * ((1 - flat) - usual)
        return health


def _grey(frame: Frame) -> Grey:
    image = frame.image
    if image.ndim == 3 and image.shape[2] == 3:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    return image.reshape(image.shape[:2])


def _exposure(grey: Grey, settings: HealthSettings) -> Health:
    # A thousandth of the pixels may be anything: stars in the dark, dust in the light.
    below = np.cumsum(cv2.calcHist([grey], [0], None, [256], [0, 256]).ravel()) / grey.size
    if int(np.searchsorted(below, 0.999)) < settings.dark:
        return Health(HealthStatus.DARK, "The image is dark.")
    if int(np.searchsorted(below, 0.03)) > settings.bright:
        return Health(HealthStatus.SATURATED, "The image is saturated.")
    return Health(HealthStatus.OK)


def _noise(grey: Grey, settings: HealthSettings) -> Health:
    """Noise by Immerkaer's kernel, which does not see slopes; the low quartile spares texture."""
    kernel = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], dtype=np.float32)
    # Filtered at full resolution, for noise is fine, but a quarter of the pixels tell enough.
    response = np.abs(cv2.filter2D(grey, cv2.CV_16S, kernel)[::2, ::2])
    sigma = float(np.quantile(response, 0.25)) / (0.319 * 6.0)
    if sigma > settings.noisy:
        return Health(HealthStatus.NOISY, "The image is noisy.")
    return Health(HealthStatus.OK)


def _scrambled(grey: Grey, settings: HealthSettings) -> Health:
    """Steps along whole block lines, far steeper than between them, nearly everywhere."""
    ratios = []
    for image in (grey, grey.T):
        lines = np.ascontiguousarray(image[:: max(1, len(image) // LINES)])
        step = np.median(cv2.absdiff(lines[:, 1:], lines[:, :-1]), axis=0)
        for block in (8, 16, 32):
            at = np.arange(len(step)) % block == block - 1
            if at.sum() > 3:
                ratios.append(float(np.mean(step[at]) / (np.mean(step[~at]) + 1.0)))
    if ratios and max(ratios) > settings.scrambled:
        return Health(HealthStatus.SCRAMBLED, "The image is broken into blocks.")
    return Health(HealthStatus.OK)


def _flat_share(grey: Grey) -> float:
    """Share of blocks without any texture, 0 to 1."""
    rows, cols = grey.shape[0] // BLOCK, grey.shape[1] // BLOCK
    if rows * cols == 0:
        return 0.0
    part = grey[: rows * BLOCK, : cols * BLOCK].astype(np.float32)
    size = (cols, rows)
    mean = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    square = cv2.resize(part * part, size, interpolation=cv2.INTER_AREA)
    return float(np.mean(square - mean * mean < 1.0))
