"""Annotated frames."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.report.scene import frame_at, mind_at
from visup.agent import Alert, Mind, Presence, Severity
from visup.report.annotate import _label_box, _overlap, annotate, label_of
from visup.report.image_text import fitted, ink
from visup.report.palette import OBJECT_COLOURS, object_colour

SIZES = [(640, 480), (320, 240), (1280, 720), (64, 48), (200, 400), (17, 9)]


@pytest.mark.parametrize("size", SIZES)
def test_annotation_is_pure_and_deterministic(size: tuple[int, int]) -> None:
    frame, mind = frame_at(45, size), mind_at(45, size)
    before = frame.image.copy()
    once, again = annotate(frame.image, mind), annotate(frame.image, mind)
    assert np.array_equal(frame.image, before)
    assert np.array_equal(once, again)
    assert once.shape == frame.image.shape
    assert once.dtype == np.uint8
    assert not np.shares_memory(once, frame.image)


def test_an_empty_mind_changes_nothing_but_the_clock() -> None:
    image = np.full((480, 640, 3), 90, np.uint8)
    changed = (annotate(image, Mind(time=1.0, frame_size=(640, 480))) != image).any(axis=2)
    ys, xs = np.nonzero(changed)
    assert ys.min() > 430
    assert xs.min() > 540


def test_an_object_is_outlined_in_its_own_colour() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    mind = replace(mind_at(10), tasks=(), alerts=())
    out = annotate(image, mind)
    for id_, belief in mind.objects.items():
        x, y = belief.region.contour[len(belief.region.contour) // 2].astype(int)
        near = out[max(0, y - 2) : y + 3, max(0, x - 2) : x + 3].reshape(-1, 3).astype(int)
        wanted = np.array(object_colour(id_)[::-1])
        assert np.abs(near - wanted).sum(axis=1).min() < 60


def test_objects_that_left_or_are_unconfirmed_are_not_drawn() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    mind = replace(mind_at(10), tasks=(), alerts=())
    gone = {i: replace(b, presence=Presence.LEFT) for i, b in mind.objects.items()}
    unsure = {i: replace(b, confirmed=False) for i, b in mind.objects.items()}
    nothing = annotate(image, replace(mind, objects=MappingProxyType({})))
    for objects in (gone, unsure):
        assert np.array_equal(
            annotate(image, replace(mind, objects=MappingProxyType(objects))), nothing
        )


def test_a_hidden_object_is_dashed_not_solid() -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    mind = replace(mind_at(10), tasks=(), alerts=())
    hidden = {i: replace(b, presence=Presence.HIDDEN) for i, b in mind.objects.items()}
    solid = annotate(image, mind).max(axis=2) > 0
    dashed = annotate(image, replace(mind, objects=MappingProxyType(hidden))).max(axis=2) > 0
    contour = mind.objects[1].region.contour.astype(int)
    on_solid = np.mean([solid[y, x] for x, y in contour])
    on_dashed = np.mean([dashed[y, x] for x, y in contour])
    assert on_solid > 0.95
    assert 0.3 < on_dashed < 0.8


@pytest.mark.parametrize("severity", [Severity.WARNING, Severity.CRITICAL])
def test_an_open_alert_is_at_the_top_until_it_closes(severity: Severity) -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    alert = Alert(1, "collision_course", severity, 1.0, 2.0, (), "Two objects may collide.")
    shown = annotate(image, Mind(alerts=(alert,)))[:20]
    closed = annotate(image, Mind(alerts=(replace(alert, closed=3.0),)))[:20]
    assert (shown > 0).any(axis=2).mean() > 0.9
    assert not closed.any()


@pytest.mark.parametrize("text", ["", "a", "spartan 87 %", "Ünïcödé → 対象 🚀", "x" * 500])
@pytest.mark.parametrize("width", [0, 5, 60, 400])
def test_text_is_shortened_to_fit(text: str, width: int) -> None:
    out = fitted(text, 14, width)
    assert out == text or out.endswith("…") or out == ""
    assert ink(out, 14).shape[1] <= max(width, 1)


BOXES = st.tuples(
    st.integers(0, 600), st.integers(0, 440), st.integers(1, 300), st.integers(1, 300)
)


@given(boxes=st.lists(BOXES, min_size=1, max_size=8))
@settings(max_examples=100, deadline=None)
def test_labels_stay_inside_and_apart(boxes: list[tuple[int, int, int, int]]) -> None:
    placed: list[tuple[int, int, int, int]] = []
    for box in boxes:
        tag = _label_box(box, (120, 24), placed, (26, 454), 640)
        assert tag[0] >= 0
        assert tag[0] + tag[2] <= 640
        assert tag[1] >= 26
        assert tag[1] + tag[3] <= 454
        assert not any(_overlap(tag, other) for other in placed)
        placed.append(tag)


def test_labels_have_name_and_share() -> None:
    belief = mind_at(20).objects[1]
    mind = Mind()
    assert label_of(belief, mind) == f"1 spartan {belief.strength * 100:.0f} %"
    assert label_of(replace(belief, candidates=()), mind) == "1"
    played = replace(mind, actors={"the_satellite": ("spartan",)})
    assert label_of(belief, played) == f"1 the satellite {belief.strength * 100:.0f} %"


def test_neighbouring_objects_differ_in_colour() -> None:
    for i in range(1, 50):
        assert len({object_colour(i + k) for k in range(len(OBJECT_COLOURS))}) == 7
