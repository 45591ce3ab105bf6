"""Damaged files and odd masks: a small campaign of each, and the campaigns' own parts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.oracles.shape.corrupt import CORRUPTIONS, MASKS, corrupt_file, odd_mask
from tests.oracles.shape.robustness import (
    evaluate_robustness,
    sound_database,
    try_file,
    try_mask,
)
from tests.percepts.shape.shapes import ZOO
from visup.agent.model.errors import DatabaseError, SettingsError
from visup.commands.eval.catalogue import app as eval_app
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.silhouette.silhouette import normalise


def test_damaged_files_and_odd_masks_are_refused_answered_or_nothing() -> None:
    figures = evaluate_robustness(files=144, masks=96, seed=11, largest=900)
    assert figures["failures"] == []
    assert set(figures["items"]) == {*CORRUPTIONS, *MASKS}
    assert figures["total"]["trials"] == 240
    assert figures["items"]["foreign"]["refused"] == 12
    assert figures["items"]["empty"]["nothing"] == 8


def test_a_table_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.db"
    sound = sound_database(path, 0).path.read_bytes()
    for at in range(8):
        path.write_bytes(
            sound.replace(b"CREATE TABLE models", b"CREATE TA\xff\xff models"[: 19 + at])
        )
        with pytest.raises(DatabaseError):
            ModelDatabase.open(path)


def test_a_campaign_is_the_same_for_the_same_seed(tmp_path: Path) -> None:
    sound = sound_database(tmp_path / "sound.db", 0).path.read_bytes()
    assert sound_database(tmp_path / "again.db", 0).path.read_bytes() == sound
    for kind in CORRUPTIONS:
        contents = []
        for _ in range(2):
            corrupt_file(tmp_path / "damaged.db", sound, kind, np.random.default_rng(4))
            contents.append((tmp_path / "damaged.db").read_bytes())
        assert contents[0] == contents[1] != sound, kind


def test_failures_are_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = sound_database(tmp_path / "sound.db", 0)

    def breaks(path: Path) -> ModelDatabase:
        raise KeyError("a bug")

    monkeypatch.setattr(ModelDatabase, "open", breaks)
    outcome = try_file(sound, tmp_path / "damaged.db", 0, 0)
    assert outcome.failed
    assert "KeyError" in outcome.what
    monkeypatch.setattr(ModelDatabase, "query", lambda *_, **__: 1 / 0)
    assert "ZeroDivisionError" in try_mask(sound, 0, 0, 64).what


def test_the_largest_masks_are_normalised() -> None:
    for kind in ("noise", "checkered", "combed"):
        mask = odd_mask(kind, (4000, 4000), np.random.default_rng(1))
        silhouette = normalise(mask)  # type: ignore[arg-type]
        assert silhouette is None or len(silhouette.contour) <= 640


@pytest.mark.parametrize("dtype", ["f4", "c8", "O", "U1"])
def test_a_mask_of_another_type_is_refused(dtype: str) -> None:
    with pytest.raises(SettingsError, match="mask of 2 dimensions"):
        normalise(ZOO["star"].astype(dtype))
    with pytest.raises(SettingsError, match="mask of 3 dimensions"):
        normalise(ZOO["star"][..., None])


@pytest.mark.parametrize("dtype", ["u1", "i8", "u2", "i1"])
def test_integer_masks_are_read_as_zero_or_not(dtype: str) -> None:
    expected = normalise(ZOO["star"])
    # The value 256 is not zero, though its lowest byte is.
    found = normalise(ZOO["star"].astype(dtype) * np.array(64 if dtype[1] == "1" else 256, dtype))
    assert expected is not None
    assert found is not None
    np.testing.assert_array_equal(found.contour, expected.contour)


def test_the_command_prints_a_table() -> None:
    result = CliRunner().invoke(eval_app, ["robustness", "--files", "12", "--masks", "12"])
    assert result.exit_code == 0, result.output
    assert "flipped" in result.output
    assert "refused" in result.output
