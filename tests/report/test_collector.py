"""What is kept of a run."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.report.scene import END_S, FPS, TOLD, TOUCH_S, mind_at, run, step_at
from visup.agent import Event, Relation, Severity, Truth, Verdict
from visup.agent.model.errors import SettingsError
from visup.report.collector import Collector, ReportLimits
from visup.report.crops import object_crop, shrunk
from visup.report.moments import sample_of, weight_of


def collected(limits: ReportLimits | None = None) -> Collector:
    collector = Collector(limits or ReportLimits())
    for step, frame in run((160, 120)):
        collector.add(step, frame)
    return collector


def test_a_short_run_is_kept_completely() -> None:
    data = collected().finish(Verdict.FAILED, {"source": "clip.mp4"})
    assert (data.source, data.verdict, data.frames) == ("clip.mp4", Verdict.FAILED, END_S * FPS + 1)
    assert data.duration == END_S
    assert data.frame_size == (160, 120)
    assert [e.text for e in data.events] == [
        text for told in TOLD.values() for _, _, text, _ in told
    ]
    assert [(a.id, a.closed) for a in data.alerts] == [(1, None)]
    assert [(s.id, s.name) for s in data.objects] == [(1, "spartan"), (2, "rms_arm")]
    assert len(data.samples) == data.frames
    assert data.tasks[0].verdict is Verdict.FAILED
    assert {e.behaviour: (e.runs, e.mean_ms) for e in data.behaviour_costs} == {
        "motion": (61, 41.0),
        "shape": (31, 12.5),
    }


def test_key_frames_are_those_of_events_and_the_two_ends() -> None:
    data = collected().finish()
    assert [k.frame_index for k in data.key_frames] == [*sorted(TOLD), 60]
    for key in data.key_frames:
        image = cv2.imdecode(np.frombuffer(key.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        assert key.size == (image.shape[1], image.shape[0])
    assert all(len(look.matches) == 5 for k in data.key_frames for look in k.closeups)
    for look in (look for k in data.key_frames for look in k.closeups):
        similarities = [m.similarity for m in look.matches]
        assert similarities == sorted(similarities, reverse=True)


def test_closeups_have_the_time_of_their_match() -> None:
    data = collected().finish()
    odd = next(k for k in data.key_frames if k.frame_index == 15)
    assert odd.closeups[0].matched_at == pytest.approx(14 / FPS)


def test_spans_follow_stages_trends_and_presence() -> None:
    data = collected().finish()
    moves = data.spans_about("relation")
    assert [s.value for s in moves] == ["converging", "diverging"]
    turn = TOUCH_S + 1 / FPS
    assert [t for s in moves for t in (s.start, s.end)] == pytest.approx([0.0, turn, turn, END_S])
    stages = [(s.subject[2], s.value) for s in data.spans_about("stage")]
    assert stages == [
        ("approach", "progressing"),
        ("approach", "done"),
        ("captured", "pending"),
        ("captured", "active"),
        ("captured", "failing"),
    ]
    (hidden,) = [s for s in data.spans_about("presence") if s.value == "hidden"]
    assert hidden.subject == ("presence", "1")
    assert [hidden.start, hidden.end] == pytest.approx([3.2, 3.6])


def test_memory_is_bounded_whatever_the_length() -> None:
    limits = ReportLimits(samples=8, key_frames=3, events=2, spans=4, alerts=1)
    data = collected(limits).finish()
    assert len(data.samples) <= 8
    assert len(data.key_frames) <= 4
    assert len(data.events) == 2
    assert data.events_left_out == 3
    assert max(k.weight for k in data.key_frames) == weight_of(step_at(36).events)
    long = Collector(limits)
    for _ in range(3):
        for step, frame in run((32, 24)):
            long.add(step, frame)
    assert len(long.finish().samples) <= 8
    assert len(long.finish().key_frames) <= 4


def test_the_picture_of_a_severe_event_outlasts_many_lighter_ones() -> None:
    collector = Collector(ReportLimits(key_frames=3))
    for step, frame in run((64, 48)):
        entry = Event("entry", step.time, step.frame_index, "An object is in view.")
        collector.add(replace(step, events=(*step.events, entry)), frame)
    assert 36 in [k.frame_index for k in collector.finish().key_frames]


def test_an_empty_run_has_data() -> None:
    data = Collector().finish()
    assert (data.frames, data.key_frames, data.samples, data.spans) == (0, (), (), ())


def test_limits_that_keep_nothing_are_refused() -> None:
    with pytest.raises(SettingsError):
        Collector(ReportLimits(samples=1))


def test_distance_is_the_gap_between_outlines_unless_rules_tell_it() -> None:
    mind = mind_at(10)
    a, b = (mind.objects[i].region.contour for i in (1, 2))
    brute = min(float(np.hypot(*(p - b).T).min()) for p in a)
    assert sample_of(mind).distances[1, 2].gap == pytest.approx(brute, abs=1.5)
    told = Relation("distance", (2, 1), Truth.TRUE, 0.0, value=7.5, sigma=0.5)
    known = sample_of(replace(mind, relations=(told,))).distances[1, 2]
    assert (known.gap, known.sigma) == (7.5, 0.5)


def test_hidden_objects_have_no_distance() -> None:
    assert (1, 2) not in sample_of(mind_at(16)).distances
    assert (1, 2) in sample_of(mind_at(20)).distances


def test_important_events_weigh_more() -> None:
    def weight(kind: str, severity: Severity = Severity.INFO) -> int:
        return weight_of((Event(kind, 0.0, 0, "x", severity=severity),))

    assert weight_of(()) == weight("relation") == 0
    assert weight("stage_failing") > weight("stage_started") > weight("entry") > weight("exit") > 0
    assert weight("alert", Severity.CRITICAL) > weight("alert", Severity.WARNING) > weight("entry")


@pytest.mark.parametrize("index", [0, 30, 60])
def test_crops_fit_and_show_the_object(index: int) -> None:
    mind = mind_at(index)
    image = np.full((480, 640, 3), 200, np.uint8)
    for belief in mind.objects.values():
        part = object_crop(image, belief)
        assert max(part.shape[:2]) == 112
        _, _, w, h = belief.region.bbox
        assert math.isclose(part.shape[1] / part.shape[0], w / h, rel_tol=0.5)
        assert part.max() == 200
        assert part.min() == 50


def test_shrinking_keeps_small_pictures_and_proportions() -> None:
    small = np.zeros((48, 64, 3), np.uint8)
    assert shrunk(small, 720) is small
    assert shrunk(np.zeros((1080, 1920, 3), np.uint8), 720).shape == (405, 720, 3)
