"""The compiled sampling of cut views against plain NumPy, to the last bit."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from visup.percepts.shape.matching._truncated_views_jit import (
    Samples,
    places_of_samples,
    weighted_remainders,
)

BLUR, HALF, PIXELS = 0.06, 3.6, 24


@pytest.mark.parametrize("seed", range(5))
def test_remainders_are_sampled_as_by_plain_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bearings = np.sort(rng.uniform(-np.pi, np.pi, 7))
    centres, units = rng.normal(0.0, 0.3, (7, 3, 2)), rng.uniform(0.7, 1.0, 3)
    offsets, radii = rng.normal(0.3, 0.3, (7, 3)), np.linspace(0.05, 2.9, 9)
    weights = np.sqrt(radii)
    tone = cv2.GaussianBlur(rng.random((172, 172)).astype(np.float32), (0, 0), 1.5)
    around = bearings[:, None] + np.arange(16) * (2 * np.pi / 16)
    directions = np.stack([np.cos(around), np.sin(around)])
    normals = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)

    reach = (units[:, None] * radii)[None, :, :, None]
    x = centres[..., 0, None, None] + reach * directions[0][:, None, None]
    y = centres[..., 1, None, None] + reach * directions[1][:, None, None]
    places = [((n + HALF) * PIXELS - 0.5).reshape(-1, 16).astype(np.float32) for n in (x, y)]
    samples = Samples(centres, units, radii, directions)
    at = places_of_samples(samples, HALF, PIXELS)
    assert np.array_equal(at, places)

    seen = cv2.remap(tone, at[0], at[1], cv2.INTER_LINEAR)
    beyond = x * normals[:, None, None, None, 0] + y * normals[:, None, None, None, 1]
    inside = np.clip((offsets[..., None, None] - beyond) / BLUR + 0.5, 0.0, 1.0)
    assert ((inside > 0.0) & (inside < 1.0)).any()
    maps = seen.astype(np.float64).reshape(x.shape) * inside * weights[:, None]
    tones = np.asarray(seen, np.float32)
    found = weighted_remainders(tones, samples, weights, normals, offsets, BLUR)
    assert np.array_equal(found, maps.reshape(7, 3, -1))
