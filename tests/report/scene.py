"""A made-up run: an arm closes in on a satellite, touches it, and the satellite drifts away."""

from __future__ import annotations

from collections.abc import Iterator
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import (
    Alert,
    Binding,
    Candidate,
    Event,
    Frame,
    Hypothesis,
    Mind,
    ObjectBelief,
    Observation,
    Percept,
    Presence,
    Relation,
    Report,
    ReportState,
    Severity,
    StageBelief,
    Status,
    TaskBelief,
    Truth,
    Verdict,
)
from visup.agent.model.step import Step
from visup.testing import region_of

FPS = 5.0
TOUCH_S, END_S = 6.0, 12.0
SIZE = (640, 480)


def body(points: list[tuple[float, float]], size: tuple[int, int]) -> NDArray[np.uint8]:
    mask = np.zeros((size[1], size[0]), np.uint8)
    scaled = np.array(points) * (size[0] / 640, size[1] / 480)
    cv2.fillPoly(mask, [np.round(scaled).astype(np.int32)], 255)
    return mask


def satellite_at(x: float) -> list[tuple[float, float]]:
    return [(x, 170), (x + 90, 160), (x + 110, 220), (x + 100, 300), (x + 10, 290), (x - 20, 230)]


def arm_at(x: float) -> list[tuple[float, float]]:
    return [(0, 420), (180, 300), (x - 10, 226), (x, 240), (190, 330), (0, 470)]


def masks_at(time: float, size: tuple[int, int]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    gap_arm = 240 + 80 * min(time, TOUCH_S) / TOUCH_S
    drift = 18 * max(0.0, time - TOUCH_S)
    return body(satellite_at(345 + drift), size), body(arm_at(gap_arm), size)


def frame_at(index: int, size: tuple[int, int] = SIZE) -> Frame:
    time = index / FPS
    satellite, arm = masks_at(time, size)
    noise = np.random.default_rng(index).integers(0, 22, (size[1], size[0], 3)).astype(np.uint8)
    noise[satellite > 0] += np.array([120, 150, 160], np.uint8)
    noise[arm > 0] += np.array([190, 185, 180], np.uint8)
    return Frame(index, time, noise)


def candidates(time: float, names: tuple[str, ...]) -> tuple[Candidate, ...]:
    votes = [min(1.0, 0.1 + 0.15 * time), 0.3 * np.exp(-time / 4) + 0.1, 0.05]
    total = sum(votes)
    pairs = zip(names, votes, strict=True)
    return tuple(Candidate(n, float(v), float(v / total)) for n, v in pairs)


def mind_at(index: int, size: tuple[int, int] = SIZE, task: str = "dock") -> Mind:
    time = index / FPS
    satellite, arm = masks_at(time, size)
    beliefs = {
        1: ("spartan", "umbrella", "guitar"),
        2: ("rms_arm", "crane", "dolphin"),
    }
    objects = {
        id_: ObjectBelief(
            id_,
            region_of(mask > 0, id_),
            Presence.HIDDEN if id_ == 1 and 3.0 < time < 3.5 else Presence.SEEN,
            0.0,
            time,
            confirmed=True,
            candidates=candidates(time, beliefs[id_]),
        )
        for id_, mask in ((1, satellite), (2, arm))
    }
    lost = time > TOUCH_S + 1
    move = "diverging" if time > TOUCH_S else "converging"
    alert = Alert(
        1,
        "stage_failing",
        Severity.CRITICAL,
        TOUCH_S + 1,
        time,
        (1, 2),
        "The stage 'captured' is failing: the satellite and the arm are diverging.",
        ("diverging since 6.2 s at 17.9 px/s", "stage 'captured' requires them to be coupled"),
    )
    return Mind(
        time=time,
        frame_index=index,
        frame_size=size,
        objects=MappingProxyType(objects),
        relations=(Relation(move, (1, 2), Truth.TRUE, 0.0, value=18.0),),
        tasks=(task_at(time, task),),
        alerts=(alert,) if lost else (),
    )


def task_at(time: float, task: str) -> TaskBelief:
    lost = time > TOUCH_S + 1
    first = Status.DONE if time >= TOUCH_S else Status.PROGRESSING
    second = Status.FAILING if lost else Status.PENDING
    second = Status.ACTIVE if TOUCH_S <= time <= TOUCH_S + 1 else second
    return TaskBelief(
        task,
        Verdict.FAILED if lost else Verdict.IN_PROGRESS,
        (
            StageBelief("approach", first, 0.0),
            StageBelief("captured", second, TOUCH_S, evidence="They have been diverging."),
        ),
        current="captured" if time >= TOUCH_S else "approach",
        bindings=(
            Binding("satellite", ("spartan",), 1, 0.9),
            Binding("arm", ("rms_arm",), 2, 0.8),
        ),
        evidence="The satellite and the arm have been diverging since 6.2 s." if lost else "",
    )


TOLD: dict[int, list[tuple[str, Severity, str, tuple[int, ...]]]] = {
    0: [("entry", Severity.INFO, "An object, believed to be the satellite, is in view.", (1,))],
    5: [
        (
            "identified",
            Severity.INFO,
            "The satellite and the arm appear to be converging.",
            (1, 2),
        )
    ],
    15: [("occlusion", Severity.INFO, "The satellite appears to be hidden.", (1,))],
    30: [("stage_done", Severity.INFO, "The stage 'approach' is complete.", ())],
    36: [
        ("alert", Severity.CRITICAL, "The stage 'captured' is failing: they are diverging.", (1, 2))
    ],
}


def step_at(index: int, size: tuple[int, int] = SIZE, task: str = "dock") -> Step:
    time = index / FPS
    mind = mind_at(index, size, task)
    regions = [Percept("region", b.region, time, "motion") for b in mind.objects.values()]
    rng = np.random.default_rng(index)
    names = ("spartan", "rms_arm", "guitar", "umbrella", "crane", "dolphin")
    looks = [
        Percept("hypothesis", Hypothesis(r, n, v, float(rng.uniform(0.3, 0.95))), time, "shape")
        for r in (1, 2)
        for v, n in enumerate(names)
    ]
    reports = (
        Report("motion", ReportState.RAN, ("region",), tuple(regions), elapsed_ms=41.0),
        Report("shape", ReportState.RAN, ("hypothesis",), tuple(looks), elapsed_ms=12.5)
        if index % 2 == 0
        else Report("shape", ReportState.RESTED, ("hypothesis",)),
    )
    events = tuple(
        Event(kind, time, index, text, objects, severity=severity)
        for kind, severity, text, objects in TOLD.get(index, [])
    )
    return Step(index, time, Observation(index, time, size, reports), mind, events, mind.alerts)


def run(size: tuple[int, int] = SIZE, task: str = "dock") -> Iterator[tuple[Step, Frame]]:
    """Every step of the run with its frame."""
    for index in range(int(END_S * FPS) + 1):
        yield step_at(index, size, task), frame_at(index, size)
