"""Objects of a run for other tools: each box in view once, in the format of the tool."""

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


def test_mot_and_coco_have_the_same_boxes(run: Path, tmp_path: Path) -> None:
    in_view = [o for o in visup.open_run(run).objects if o.confirmed and o.presence == "seen"]
    assert export(run, "mot", tmp_path / "a.txt") == len(in_view) > 10
    assert export(run, "coco", tmp_path / "a.json") == len(in_view)
    lines = [line.split(",") for line in (tmp_path / "a.txt").read_text().splitlines()]
    document = json.loads((tmp_path / "a.json").read_text())
    mot = [(int(n) - 1, int(i), [int(v) for v in box]) for n, i, *box in (x[:6] for x in lines)]
    coco = [(a["image_id"], a["track_id"], a["bbox"]) for a in document["annotations"]]
    assert mot == coco == [(o.frame_index, o.id, list(o.bbox)) for o in in_view]
    assert {a["category_id"] for a in document["annotations"]} == {
        c["id"] for c in document["categories"]
    }
    assert {a["image_id"] for a in document["annotations"]} <= {i["id"] for i in document["images"]}
    assert all((i["width"], i["height"]) == (96, 72) for i in document["images"])


def test_fiftyone_has_the_same_boxes_as_shares_of_the_picture(run: Path, tmp_path: Path) -> None:
    in_view = [o for o in visup.open_run(run).objects if o.confirmed and o.presence == "seen"]
    assert export(run, "fiftyone", tmp_path / "a.json") == len(in_view)
    frames = json.loads((tmp_path / "a.json").read_text())["frames"]
    labels = [
        (int(number) - 1, o["index"], o["label"], o["bounding_box"])
        for number, frame in frames.items()
        for o in frame["objects"]["objects"]
    ]
    assert [t[:3] for t in labels] == [(o.frame_index, o.id, o.name) for o in in_view]
    for (*_, corners), o in zip(labels, in_view, strict=True):
        (left, top), (right, bottom) = (
            (round(96 * corners[k]["x"], 6), round(72 * corners[k]["y"], 6))
            for k in ("top_left", "bottom_right")
        )
        assert (left, top, right - left, bottom - top) == pytest.approx(o.bbox)


def test_csv_has_all_beliefs(run: Path, tmp_path: Path) -> None:
    count = export(run, "csv", tmp_path / "a.csv")
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()))
    in_view = [r for r in rows if (r["presence"], r["confirmed"]) == ("seen", "True")]
    assert len(rows) == len(list(visup.open_run(run).objects)) > len(in_view)
    assert len(in_view) == count == export(run, "mot", tmp_path / "a.txt")


def test_unknown_formats_and_unwritable_files_are_refused(run: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="one of: mot, coco, fiftyone, csv"):
        export(run, "xml", tmp_path / "a.xml")
    with pytest.raises(OutputError):
        export(run, "mot", tmp_path / "no" / "a.txt")
    with pytest.raises(OutputError):
        export(tmp_path, "mot", tmp_path / "a.txt")
