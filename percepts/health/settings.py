"""Thresholds of the health behaviour."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HealthSettings:
    """Thresholds of `HealthBehaviour`.

    Grey levels are those of 8 bits. "Usual" is what the last second without a fault showed.

    Attributes:
        dark: What is brightest in a dark image does not exceed this grey level.
        bright: What is darkest in a saturated image exceeds this grey level.
        flat: Grey levels between the darkest and the brightest of an image that shows nothing.
        noisy: Standard deviation of pixel noise, grey levels, that is always too much.
        rather_noisy: The same, when it is also three times what is usual.
        impulses: Share of pixels that stick out, always too much.
        rather_impulses: The same, when it is also three times what is usual.
        broken: Share of pixels on straight steps, always too much.
        rather_broken: The same beyond 1.7 times what is usual.
        covered: Share of the view that must be covered to be blocked.
        lost: Share of frames that must be missing within a second; twice that when others are
            repeated in their place.
        gap: Frames that are missing in a row.
        same_s: How long an image must be the very same before it is called frozen, seconds.
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
