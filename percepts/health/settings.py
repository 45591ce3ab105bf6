"""Thresholds of the health behaviour."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HealthSettings:
    """Thresholds of `HealthBehaviour`.

    Grey levels are 8-bit. "Usual" refers to the last second without a fault.

    Attributes:
        dark: The brightest part of a dark image does not exceed this grey level.
        bright: The darkest part of a saturated image exceeds this grey level.
        flat: Grey levels between the darkest and the brightest part of a blank image.
        noisy: Standard deviation of pixel noise, grey levels, that is always too high.
        rather_noisy: The same, if also three times the usual.
        impulses: Share of outlier pixels that is always too high.
        rather_impulses: The same, if also three times the usual.
        broken: Share of pixels on straight steps that is always too high.
        rather_broken: The same, beyond 1.7 times the usual.
        covered: Share of the view that must be covered to be blocked.
        lost: Share of frames that must be missing within a second; twice that when others are
            repeated in their place.
        gap: Frames that are missing in a row.
        same_s: How long an image must be unchanged to be frozen, seconds.
        lasting_s: How long other faults must last before they are reported, seconds.
    """

    dark: float = 20.0
    bright: float = 242.0
    flat: float = 10.0
    noisy: float = 16.0
    rather_noisy: float = 6.0
    impulses: float = 0.06
    rather_impulses: float = 0.02
    broken: float = 0.02
    rather_broken: float = 0.0007
    covered: float = 0.22
    lost: float = 0.1
    gap: int = 3
    same_s: float = 0.5
    lasting_s: float = 0.3
