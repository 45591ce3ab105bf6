"""Networks of the YOLO family: the same things in every layout, in the pixels of the picture."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import visup
from tests.clips import moving_disc, write_clip
from visup.agent import Frame
from visup.agent.model.errors import SettingsError
from visup.percepts.detections import Detection, YoloNetwork, decode_yolo, letterbox
from visup.percepts.detections.boxes import intersection_over_union

NAMES = ("person", "cup", "robot")
Thing = tuple[tuple[float, float, float, float], int, float]
"""Box (x, y, width, height), class, score."""

THINGS: list[Thing] = [
    ((10, 20, 30, 40), 1, 0.9),
    ((200, 100, 50, 20), 0, 0.6),
    ((5, 5, 8, 8), 2, 0.3),
]


def classes_as_columns(things: list[Thing], classes: int) -> NDArray[np.float32]:
    """(1, 4 + C, N), candidates that are nothing among them."""
    rows = np.zeros((400, 4 + classes), np.float32)
    for k, ((x, y, w, h), number, score) in enumerate(things):
        rows[7 * k, :4] = x + w / 2, y + h / 2, w, h
        rows[7 * k, 4 + number] = score
    return rows.T[None]


def with_objectness(things: list[Thing], classes: int) -> NDArray[np.float32]:
    """(1, N, 5 + C)."""
    rows = classes_as_columns(things, classes)[0].T
    anything = np.full((len(rows), 1), 0.98, np.float32)
    scores = np.clip(rows[:, 4:] / 0.98, 0, 1)
    return np.hstack([rows[:, :4], anything, scores])[None]


def chosen(things: list[Thing], classes: int) -> NDArray[np.float32]:
    """(1, N, 6)."""
    rows = np.zeros((300, 6), np.float32)
    for k, ((x, y, w, h), number, score) in enumerate(things):
        rows[k] = x, y, x + w, y + h, score, number
    return rows[None]


LAYOUTS = (classes_as_columns, with_objectness, chosen)
Layout = Callable[[list[Thing], int], NDArray[np.float32]]


def same(found: tuple[Detection, ...], things: list[Thing], names: tuple[str, ...]) -> None:
    wanted = sorted((t for t in things if t[2] >= 0.25), key=lambda t: -t[2])
    assert [d.name for d in found] == [names[n] for _, n, _ in wanted]
    for detection, (box, _, score) in zip(found, wanted, strict=True):
        assert detection.box == pytest.approx(box, abs=1e-3)
        assert detection.score == pytest.approx(score, abs=1e-3)
        assert detection.track == 0


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("classes", [1, 2, 3, 80])
@pytest.mark.parametrize("named", [True, False])
def test_every_layout_tells_the_same_things(layout: Layout, classes: int, named: bool) -> None:
    things = [(box, number % classes, score) for box, number, score in THINGS]
    names = tuple(f"thing {n}" for n in range(classes))
    given_ = names if named else ()
    output = layout(things, classes)
    told = names if named else tuple(f"class {n}" for n in range(classes))
    same(decode_yolo(output, given_), things, told)
    same(decode_yolo(output[0], given_), things, told)


@given(st.integers(8, 300), st.integers(8, 300), st.integers(1, 9), st.integers(1, 9))
def test_boxes_come_back_to_where_they_are_in_the_picture(w: int, h: int, x: int, y: int) -> None:
    picture = np.zeros((h, w, 3), np.uint8)
    blob, fitted = letterbox(picture, (640, 480))
    assert blob.shape == (1, 3, 480, 640)
    assert 0 <= fitted.left <= 320
    assert 0 <= fitted.top <= 240
    corners = np.array([[x, y, x + 3, y + 2]], np.float32)
    moved = corners * fitted.scale + np.array([fitted.left, fitted.top] * 2)
    assert fitted.back(moved.astype(np.float32)) == pytest.approx(corners, abs=1e-3)


def test_of_boxes_upon_each_other_the_surest_of_each_class_is_left() -> None:
    things: list[Thing] = [
        ((10, 10, 40, 40), 0, 0.9),
        ((12, 11, 40, 40), 0, 0.8),
        ((11, 10, 40, 40), 1, 0.7),
        ((100, 10, 40, 40), 0, 0.6),
    ]
    found = decode_yolo(classes_as_columns(things, 3), NAMES)
    assert [(d.name, round(d.score, 2)) for d in found] == [
        ("person", 0.9),
        ("cup", 0.7),
        ("person", 0.6),
    ]
    assert intersection_over_union(found[0].box, found[2].box) == 0.0


def test_arrays_of_no_layout_are_refused() -> None:
    for shape in ((3,), (1, 3, 4), (2, 3, 84, 100)):
        with pytest.raises(ValueError, match="layouts"):
            decode_yolo(np.zeros(shape, np.float32))


def bright_spot_network(path: Path, side: int = 64, notes: dict[str, str] | None = None) -> Path:
    """A network of one class: a box of 16 pixels at the middle of each block, scored by its red."""
    onnx = pytest.importorskip("onnx", reason="onnx is not installed")
    helper, float_ = onnx.helper, onnx.TensorProto.FLOAT
    blocks = side // 16
    centres = [(16 * c + 8, 16 * r + 8, 16, 16) for r in range(blocks) for c in range(blocks)]
    boxes = np.array(centres, np.float32).T[None]
    nodes = [
        helper.make_node(
            "AveragePool", ["images"], ["means"], kernel_shape=[16, 16], strides=[16, 16]
        ),
        helper.make_node("Slice", ["means", "zero", "one", "one"], ["red"]),
        helper.make_node("Reshape", ["red", "flat"], ["scores"]),
        helper.make_node("Concat", ["boxes", "scores"], ["output0"], axis=1),
    ]
    fixed = [
        helper.make_tensor("boxes", float_, boxes.shape, boxes.reshape(-1)),
        helper.make_tensor("zero", onnx.TensorProto.INT64, [1], [0]),
        helper.make_tensor("one", onnx.TensorProto.INT64, [1], [1]),
        helper.make_tensor("flat", onnx.TensorProto.INT64, [3], [1, 1, blocks * blocks]),
    ]
    taken = helper.make_tensor_value_info("images", float_, [1, 3, side, side])
    given_ = helper.make_tensor_value_info("output0", float_, [1, 5, blocks * blocks])
    graph = helper.make_graph(nodes, "spots", [taken], [given_], fixed)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    helper.set_model_props(model, notes or {"names": "{0: 'lamp'}"})
    onnx.save(model, path)
    return path


def with_a_lamp(picture: NDArray[np.uint8], x: int, y: int) -> NDArray[np.uint8]:
    lit = picture.copy()
    lit[y : y + 32, x : x + 32] = (0, 0, 255)
    return lit


def test_a_network_finds_in_pixels_of_the_picture(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="visup[onnx] is not installed")
    network = YoloNetwork(bright_spot_network(tmp_path / "lamps.onnx"))
    assert (network.names, network.size) == (("lamp",), (64, 64))
    # 128 x 96 is fitted by a half, with 8 grey rows above: a block of the network is 32 pixels wide.
    lit = with_a_lamp(np.zeros((96, 128, 3), np.uint8), 64, 16)
    found = [d for d in network(Frame(0, 0.0, lit)) if d.score > 0.9]
    assert [(d.name, d.box) for d in found] == [("lamp", (64.0, 16.0, 32.0, 32.0))]


def test_what_is_no_network_is_refused_in_words(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="visup[onnx] is not installed")
    (tmp_path / "text.onnx").write_text("no network")
    for name, told in (("text.onnx", "cannot be read"), ("none.onnx", "no such file")):
        with pytest.raises(SettingsError, match=told):
            YoloNetwork(tmp_path / name)


@pytest.mark.parametrize("told", ["", "{", "[1, 2", "__import__('os')", "3", "{1: 'b'}"])
def test_names_that_cannot_be_read_are_none(tmp_path: Path, told: str) -> None:
    pytest.importorskip("onnxruntime", reason="visup[onnx] is not installed")
    network = YoloNetwork(bright_spot_network(tmp_path / "n.onnx", notes={"names": told}))
    assert network.names in ((), ("None",))


def test_a_network_sees_in_place_of_visup(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="visup[onnx] is not installed")
    clip = write_clip(tmp_path / "clip.avi", moving_disc(24))
    network = bright_spot_network(tmp_path / "lamps.onnx")
    run: Any = visup.watch(clip, detections=network).finish()
    assert run.steps[-1].mind.present()
    assert {h.name for s in run.steps for h in s.observation.of("hypothesis")} == {"lamp"}
