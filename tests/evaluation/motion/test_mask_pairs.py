"""Masks are matched to frames by name or number, in any order and with gaps."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model.errors import SettingsError
from visup.evaluation.motion.mask_pairs import mask_pairs


def touch_files(folder: Path, *names: str) -> list[Path]:
    folder.mkdir(exist_ok=True)
    for name in names:
        (folder / name).touch()
    return [folder / name for name in names]


def test_sparse_masks_belong_to_the_frames_of_their_names(tmp_path: Path) -> None:
    touch_files(tmp_path / "frames", *(f"in{n:06d}.jpg" for n in range(370, 400)))
    masks = touch_files(tmp_path / "masks", "in000375.png", "in000390.png")
    pairs = mask_pairs(tmp_path / "frames", masks)
    assert {n: p.name for n, p in pairs.items()} == {5: "in000375.png", 20: "in000390.png"}


@given(st.permutations(range(8)), st.sets(st.integers(0, 7)))
def test_neither_order_nor_gaps_matter(order: list[int], labelled: set[int]) -> None:
    masks = [Path(f"masks/{n:05d}.png") for n in order if n in labelled]
    assert mask_pairs(Path("video.mp4"), masks) == {n: Path(f"masks/{n:05d}.png") for n in labelled}


def test_masks_with_other_names_are_matched_by_number(tmp_path: Path) -> None:
    touch_files(
        tmp_path / "frames", "shot2_frame_08.png", "shot2_frame_09.png", "shot2_frame_10.png"
    )
    masks = touch_files(tmp_path / "masks", "mask10.png", "mask9.png")
    assert {n: p.name for n, p in mask_pairs(tmp_path / "frames", masks).items()} == {
        2: "mask10.png",
        1: "mask9.png",
    }


@pytest.mark.parametrize("masks", [["00007.png"], ["truth.png"], ["a1.png", "b1.png"]])
def test_a_mask_without_a_frame_of_its_own_is_refused(tmp_path: Path, masks: list[str]) -> None:
    touch_files(tmp_path / "frames", "00000.png", "00001.png", "00002.png")
    with pytest.raises(SettingsError, match="truth of"):
        mask_pairs(tmp_path / "frames", touch_files(tmp_path / "masks", *masks))
