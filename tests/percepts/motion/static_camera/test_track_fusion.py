"""What the layers reported before the background was known passes to blobs that show it whole."""

from __future__ import annotations

import numpy as np
import pytest

from tests.percepts.motion.static_camera.test_bodies import SIZE, body, seen
from visup.agent import Region
from visup.evaluation.motion.mask_scores import iou
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.static_camera.blob_track import BlobTracks
from visup.percepts.motion.static_camera.blob_tracker import track_blobs
from visup.percepts.motion.static_camera.track_fusion import (
    FusionFrame,
    MotionEvidence,
    TrackFusion,
)
from visup.percepts.motion.tracks.id_allocator import IdAllocator

Mask = np.ndarray
NOTHING = MotionEvidence(np.zeros((0, 2), np.float32), np.zeros(0, np.float32))


def layer(mask: Mask, number: int) -> Region:
    return describe_mask(mask, (0, 0), SIZE[::-1]).region(number, (0.0, 0.0), 1.0, 0.9)


def fused(wholes: list[Mask], shown: list[Mask]) -> tuple[tuple[Region, ...], int]:
    """Regions of the last frame, where one layer region stands for the whole; and its id."""
    fusion, ids = TrackFusion(), IdAllocator()
    number = ids.new()
    fusion.note([layer(wholes[0], number)], 0.0, 5.0)
    fusion.passthrough([layer(wholes[0], number)], ids, 100.0)
    known: BlobTracks = ()
    out: tuple[Region, ...] = ()
    last = 0
    for n, (whole, mask) in enumerate(zip(wholes, shown, strict=True), start=1):
        view = seen(mask, n=n)
        known, last = track_blobs(known, view, last)
        region = layer(whole, number)
        fusion.note([region], n / 10, 5.0)
        frame = FusionFrame(SIZE[::-1], view, NOTHING, 100.0)
        out, known = fusion.fuse(frame, known, [region], ids)
    return out, number


@pytest.mark.parametrize("gap", [5, 14])
def test_a_pair_taken_for_one_is_reported_as_two_once_the_background_shows_them(gap: int) -> None:
    one = [body(10 + 4 * n, 100) for n in range(15)]
    two = [body(34 + gap + 4 * n, 102) for n in range(15)]
    wholes = [a | b for a, b in zip(one, two, strict=True)]
    out, number = fused(wholes, wholes)
    assert len(out) == 2
    assert number in {r.id for r in out}
    for r, mask in zip(sorted(out, key=lambda r: r.bbox), (one[-1], two[-1]), strict=True):
        assert iou(r.full_mask(SIZE[::-1]), mask) > 0.95


def test_the_pieces_of_one_that_the_background_shows_in_part_are_not_reported() -> None:
    """Layers know it whole; a bar across it has the tone of the ground."""
    wholes = []
    for n in range(15):
        mask = np.zeros(SIZE, bool)
        mask[30:80, 20 + 4 * n : 70 + 4 * n] = True
        wholes.append(mask)
    shown = [m.copy() for m in wholes]
    for mask in shown:
        mask[48:60] = False
    out, number = fused(wholes, shown)
    assert [r.id for r in out] == [number]
    assert np.array_equal(out[0].full_mask(SIZE[::-1]), wholes[-1])


def test_one_that_a_blob_shows_whole_is_reported_as_its_blob() -> None:
    wholes = [body(10 + 4 * n, 100) for n in range(15)]
    rough = [np.roll(m, 3, axis=1) | m for m in wholes]
    out, number = fused(rough, wholes)
    assert [r.id for r in out] == [number]
    assert iou(out[0].full_mask(SIZE[::-1]), wholes[-1]) > 0.95 > iou(rough[-1], wholes[-1])
