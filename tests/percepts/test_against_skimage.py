"""What is computed by hand for speed, against scikit-image, which says the same in its own way."""
# mypy: disable-error-code="no-untyped-call"

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from skimage.measure import label, regionprops
from skimage.morphology import medial_axis, remove_small_objects

from tests.percepts.shape.shapes import LIMBS, limbs
from visup.percepts.motion.outlines.region_outline import clean_mask, describe_mask
from visup.percepts.shape.shocks.skeleton import skeletonise
from visup.percepts.shape.silhouette.silhouette import normalise


def blobs(seed: int) -> np.ndarray:
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(60, 80)), 3)
    return np.asarray(noise > noise.mean())


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_a_mask_is_described_as_by_region_properties(seed: int) -> None:
    mask = blobs(seed)
    found = describe_mask(mask, (7, 5), (200, 200))
    (props,) = regionprops(mask.astype(np.uint8))
    top, left, bottom, right = props.bbox
    assert found.area == props.area
    assert found.bbox == (left + 7, top + 5, right - left, bottom - top)
    assert found.centroid == pytest.approx((props.centroid[1] + 7, props.centroid[0] + 5))


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_specks_are_removed_as_by_remove_small_objects(seed: int) -> None:
    mask = blobs(seed)
    largest = max(p.area for p in regionprops(label(mask, connectivity=1)))
    kept = remove_small_objects(mask, max_size=int(np.ceil(0.1 * largest)) - 1, connectivity=1)
    cleaned = clean_mask(mask, 1.0)
    assert cleaned is not None
    # Small holes are filled as well: nothing else is added, and nothing that is kept is lost.
    assert not (kept & ~cleaned).any()
    added = label(cleaned & ~kept, connectivity=1)
    assert all(p.area <= 0.08 * largest for p in regionprops(added))


@given(LIMBS)
@settings(deadline=None, max_examples=10)
def test_skeleton_points_lie_on_the_medial_axis(angles: tuple[float, ...]) -> None:
    mask = limbs(angles)
    silhouette = normalise(mask)
    assert silhouette is not None
    skeleton = skeletonise(silhouette.contour)
    axis, distance = medial_axis(mask, return_distance=True)
    on_axis = np.argwhere(axis)[:, ::-1]
    points = skeleton.points * silhouette.unit + silhouette.origin
    gaps = np.linalg.norm(points[:, None] - on_axis[None], axis=-1)
    # Smoothing and the pixel grid move an outline by some pixels.
    near = gaps.min(axis=1)
    assert np.quantile(near, 0.9) < 0.06 * silhouette.unit
    radii = distance[tuple(on_axis[gaps.argmin(axis=1)].T[::-1])]
    assert np.median(np.abs(radii - skeleton.radii * silhouette.unit)) < 0.04 * silhouette.unit
