"""Objects of a run for other tools: each box that was seen, once, in their own form."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import visup
from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import OutputError, SettingsError
from visup.api.exports import export


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    clip = write_clip(folder / "clip.avi", moving_disc())
    visup.watch(clip, out=folder / "run").finish()
    return folder / "run"


def test_mot_and_coco_hold_the_same_boxes(run: Path, tmp_path: Path) -> None:
    seen = [o for o in visup.open_run(run).objects if o.confirmed and o.presence == "seen"]
    assert export(run, "mot", tmp_path / "a.txt") == len(seen) > 10
    assert export(run, "coco", tmp_path / "a.json") == len(seen)
    lines = [line.split(",") for line in (tmp_path / "a.txt").read_text().splitlines()]
    made = json.loads((tmp_path / "a.json").read_text())
    mot = [(int(n) - 1, int(i), [int(v) for v in box]) for n, i, *box in (x[:6] for x in lines)]
    coco = [(a["image_id"], a["track_id"], a["bbox"]) for a in made["annotations"]]
    assert mot == coco == [(o.frame_index, o.id, list(o.bbox)) for o in seen]
    assert {a["category_id"] for a in made["annotations"]} == {c["id"] for c in made["categories"]}
    assert {a["image_id"] for a in made["annotations"]} <= {i["id"] for i in made["images"]}
    assert all((i["width"], i["height"]) == (96, 72) for i in made["images"])


def test_fiftyone_has_the_same_boxes_as_shares_of_the_picture(run: Path, tmp_path: Path) -> None:
    seen = [o for o in visup.open_run(run).objects if o.confirmed and o.presence == "seen"]
    assert export(run, "fiftyone", tmp_path / "a.json") == len(seen)
    frames = json.loads((tmp_path / "a.json").read_text())["frames"]
    told = [
        (int(number) - 1, o["index"], o["label"], o["bounding_box"])
        for number, frame in frames.items()
        for o in frame["objects"]["objects"]
    ]
    assert [t[:3] for t in told] == [(o.frame_index, o.id, o.name) for o in seen]
    for (*_, corners), o in zip(told, seen, strict=True):
        (left, top), (right, bottom) = (
            (round(96 * corners[k]["x"], 6), round(72 * corners[k]["y"], 6))
            for k in ("top_left", "bottom_right")
        )
        assert (left, top, right - left, bottom - top) == pytest.approx(o.bbox)


def test_csv_holds_all_that_was_believed(run: Path, tmp_path: Path) -> None:
    count = export(run, "csv", tmp_path / "a.csv")
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    in_view = [r for r in rows if (r["presence"], r["confirmed"]) == ("seen", "True")]
    assert len(rows) == len(list(visup.open_run(run).objects)) > len(in_view)
    assert len(in_view) == count == export(run, "mot", tmp_path / "a.txt")


def test_what_cannot_be_written_is_refused(run: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="one of: mot, coco, fiftyone, csv"):
        export(run, "xml", tmp_path / "a.xml")
    with pytest.raises(OutputError):
        export(run, "mot", tmp_path / "no" / "a.txt")
    with pytest.raises(OutputError):
        export(tmp_path, "mot", tmp_path / "a.txt")
