"""Boxes of other tools in place of eyes: read as they were written, tracked, named, and reasoned about."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import visup
from tests.clips import moving_disc, write_clip
from visup.agent import Frame, Observation, Severity
from visup.agent.model.errors import SettingsError
from visup.api.exports import export
from visup.percepts.detections import Detection, DetectionsBehaviour, read_detections
from visup.testing import flat

COCO: dict[str, Any] = {
    "images": [{"id": 7}, {"id": 9}],
    "categories": [{"id": 3, "name": "cup"}],
    "annotations": [
        {"image_id": 9, "bbox": [1, 2, 3, 4], "track_id": 5, "category_id": 3, "score": 0.5}
    ],
}


def written(folder: Path, told: str | dict[str, Any]) -> Path:
    path = folder / "boxes"
    path.write_text(told if isinstance(told, str) else json.dumps(told))
    return path


def test_mot_counts_frames_from_one_and_coco_by_the_order_of_its_images(tmp_path: Path) -> None:
    mot = read_detections(written(tmp_path, "1,4,10,20,30,40,0.9,-1,-1,-1\n3,4,11,20,30,40,-1\n\n"))
    assert mot == {
        0: (Detection(4, (10, 20, 30, 40), 0.9),),
        2: (Detection(4, (11, 20, 30, 40), 1.0),),
    }
    coco = read_detections(written(tmp_path, COCO))
    assert coco == {1: (Detection(5, (1, 2, 3, 4), 0.5, "cup"),)}


@pytest.mark.parametrize(
    ("files", "frames"),
    [
        (["clip.avi#0", "clip.avi#4"], [0, 4]),  # as visup writes them: every fourth frame
        (["b.png", "a.png"], [1, 0]),
        (["left/c.jpg"], [2]),  # the truth of one image of three
        (["", ""], [0, 1]),
    ],
)
def test_images_of_coco_are_known_by_their_names(
    tmp_path: Path, files: list[str], frames: list[int]
) -> None:
    told = {
        "images": [{"id": n, "file_name": f} for n, f in enumerate(files)],
        "annotations": [{"image_id": n, "bbox": [1, 2, 3, 4]} for n in range(len(files))],
    }
    found = read_detections(written(tmp_path, told), ["a.png", "b.png", "c.png"])
    assert list(found) == frames


def test_an_image_of_coco_that_is_not_watched_is_refused(tmp_path: Path) -> None:
    told = {"images": [{"id": 1, "file_name": "d.png"}], "annotations": []}
    with pytest.raises(SettingsError, match=r"'d.png' is none of those that are watched"):
        read_detections(written(tmp_path, told), ["a.png", "b.png"])


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ("1,-1,10,20,30,40,1\n2,3,10,20,30,40,1", "some boxes have the number of a track"),
        ("0,1,10,20,30,40,1", "no frame -1"),
        ("1,1,10,20,0,40,1", "a box of 0 x 40 pixels"),
        ("1,1,10", "line 1 has 3 values"),
        ("a,b,c,d,e,f", "could not convert"),
        ("{", "cannot be used"),
        ({"annotations": []}, "no 'images'"),
        ({**COCO, "annotations": [{"image_id": 8, "bbox": [1, 2, 3, 4], "track_id": 1}]}, "no 8"),
    ],
)
def test_what_cannot_be_used_is_refused_in_words(tmp_path: Path, told: Any, said: str) -> None:
    with pytest.raises(SettingsError, match="detections cannot be used") as refused:
        read_detections(written(tmp_path, told))
    assert said in str(refused.value)
    with pytest.raises(SettingsError, match="cannot be read"):
        read_detections(tmp_path / "none")


@given(
    st.floats(-50, 120),
    st.floats(-50, 90),
    st.floats(0.1, 150),
    st.floats(0.1, 120),
    st.floats(0, 1),
)
def test_a_region_is_what_shows_of_a_box(
    x: float, y: float, w: float, h: float, sure: float
) -> None:
    frame = flat(100, frames=1)[0].frame
    seen = DetectionsBehaviour({0: (Detection(1, (x, y, w, h), sure),)})
    for percept in seen.perceive(frame, Observation(0, 0.0, frame.size), ()):
        region = percept.value
        left, top, width, height = region.bbox
        assert 0 <= left < left + width <= frame.size[0]
        assert 0 <= top < top + height <= frame.size[1]
        assert abs(left - max(0, x)) <= 1
        assert region.mask.shape == (height, width)
        assert region.area == width * height


def test_velocities_are_those_of_the_boxes() -> None:
    rows = {k: (Detection(1, (10.0 + 2 * k, 20.0, 8, 8)),) for k in range(20)}
    eyes = DetectionsBehaviour(rows)
    for k in range(20):
        frame = Frame(k, k / 25.0, flat(100, frames=1)[0].frame.image)
        (seen,) = eyes.perceive(frame, Observation(k, k / 25.0, frame.size), ())
    assert seen.value.velocity == pytest.approx((50.0, 0.0))
    again = DetectionsBehaviour(rows)
    again.load(json.loads(json.dumps(eyes.save())))
    assert again.save() == eyes.save()


def test_what_a_run_exports_can_be_watched_instead_of_seen(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc())
    visup.watch(clip, out=tmp_path / "run", every=2).finish()
    count = export(tmp_path / "run", "coco", tmp_path / "boxes.json")
    assert sum(map(len, read_detections(tmp_path / "boxes.json").values())) == count
    seen = {
        o.frame_index
        for o in visup.open_run(tmp_path / "run").objects
        if o.presence == "seen" and o.confirmed
    }
    assert set(read_detections(tmp_path / "boxes.json")) == seen
    run = visup.watch(clip, detections=tmp_path / "boxes.json", out=tmp_path / "again").finish()
    assert run.result is not None
    assert [o.bbox for o in visup.open_run(tmp_path / "again").objects if o.presence == "seen"]


def test_names_of_a_detector_play_the_actors_of_a_task(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(40))
    rows = [
        {"image_id": k, "bbox": box, "track_id": i, "category_id": i}
        for k in range(40)
        for i, box in ((1, [2 + k, 20, 20, 20]), (2, [62, 20, 20, 20]))
    ]
    told = {
        "images": [{"id": k} for k in range(40)],
        "categories": [{"id": 1, "name": "cup"}, {"id": 2, "name": "tray"}],
        "annotations": rows,
    }
    task = tmp_path / "meet.task"
    task.write_text(
        "<meet> ::= <near> <there>\n<near> ::= converging(cup, tray)\n<there> ::= touching(cup, tray)\n"
    )
    run = visup.watch(clip, task=task, detections=written(tmp_path, told), fps=10).finish()
    assert [e.text for e in run.events if "cup" in e.text]
    assert run.steps[-1].mind.tasks[0].bindings[0].object_id is not None


def test_people_of_a_detector_are_told_in_a_line_each_and_set_off_no_alarm(tmp_path: Path) -> None:
    """They meet half-way: nothing of that is told of kinds, but where each came from and went."""
    clip = write_clip(tmp_path / "clip.avi", moving_disc(50))
    rows = [
        {"image_id": k, "bbox": box, "track_id": i, "category_id": 1}
        for k in range(50)
        for i, box in ((1, [2 * k - 4, 10, 14, 20]), (2, [88 - 2 * k, 34, 14, 20]))
        if -10 < box[0] < 90
    ]
    told = {
        "images": [{"id": k} for k in range(50)],
        "categories": [{"id": 1, "name": "person"}],
        "annotations": rows,
    }
    run = visup.watch(clip, detections=written(tmp_path, told), fps=10, out=tmp_path / "run")
    lines = [e.text for e in run.narrate()]
    assert lines  # five seconds have room for one or two
    assert all(line.startswith("Object") and " person)" in line for line in lines)
    identified = [e.text for e in visup.open_run(tmp_path / "run").events if e.kind == "identified"]
    assert identified
    assert all(text.endswith("is a person.") for text in identified)
    assert not [e for e in visup.open_run(tmp_path / "run").events if e.severity > Severity.INFO]


def test_boxes_without_numbers_are_numbered_while_they_are_watched(tmp_path: Path) -> None:
    lines = [f"{k + 1},-1,{2 + k},20,20,20,1\n{k + 1},-1,{62},40,20,20,1" for k in range(20)]
    found = read_detections(written(tmp_path, "\n".join(lines)))
    eyes = DetectionsBehaviour(found)
    tracks = []
    for k in range(20):
        frame = Frame(k, k / 10.0, flat(100, frames=1)[0].frame.image)
        seen = eyes.perceive(frame, Observation(k, k / 10.0, frame.size), ())
        tracks.append([(p.value.id, p.value.bbox[0]) for p in seen])
    assert tracks == [[(1, 2 + k), (2, 62)] for k in range(20)]


PLUGIN = """
from visup.percepts.detections import Detection, DetectorBehaviour


class Cups(DetectorBehaviour):
    def find(self, frame):
        return [Detection(0, (2 + frame.index, 20, 20, 20), 1.0, "cup")]
"""


def test_a_detector_of_ten_lines_sees_in_place_of_visup(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(20))
    (tmp_path / "cups.py").write_text(PLUGIN)
    run = visup.watch(clip, behaviours=[tmp_path / "cups.py"], motion=False).finish()
    mind = run.steps[-1].mind
    assert [(b.name, b.region.bbox) for b in mind.present()] == [("cup", (21, 20, 20, 20))]
    with pytest.raises(SettingsError, match="nothing would supply regions"):
        visup.watch(clip, motion=False)
