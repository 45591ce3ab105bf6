"""Ground truth of a rendered scene, from its geometry and the scenario's annotations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from visup.render.imaging.renderer import RenderedFrame, Renderer
from visup.render.scenario.scenario import Scenario
from visup.render.scenario.trajectories import Matrix

MIN_ENTERED_SHARE = 0.10
"""An object is in the image while its amodal area is at least this share of its maximum."""

OCCLUDED_BELOW, VISIBLE_ABOVE = 0.20, 0.50
"""An object is occluded when less than the first share of it is visible, and visible again above the
second."""


def frame_truth(frame: RenderedFrame, labels: Mapping[str, int]) -> dict[str, Any]:
    """Ground truth of one frame.

    Args:
        frame: The frame.
        labels: Object -> mask value.

    Returns:
        ``index`` and, for each object: ``visible_px``, ``amodal_px``, ``bbox`` [x, y, w, h] of what is
        visible (absent when nothing is), ``range_m`` from the camera to the object's origin,
        ``quat_xyzw`` from the object's frame to the camera's (x right, y down, z forward); the last
        two not for arms, which have no pose of their own.
    """
    out: dict[str, Any] = {"index": frame.index}
    for name, label in labels.items():
        visible = frame.mask == label
        record: dict[str, Any] = {
            "visible_px": int(np.count_nonzero(visible)),
            "amodal_px": frame.amodal_px[name],
        }
        if record["visible_px"]:
            ys, xs = np.flatnonzero(visible.any(axis=1)), np.flatnonzero(visible.any(axis=0))
            record["bbox"] = [
                int(v) for v in (xs[0], ys[0], xs[-1] - xs[0] + 1, ys[-1] - ys[0] + 1)
            ]
        if name in frame.poses:
            record |= _pose(frame.poses[name])
        out[name] = record
    return out


def _pose(pose: Matrix) -> dict[str, Any]:
    quat = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return {
        "range_m": round(float(np.linalg.norm(pose[:3, 3])), 5),
        "quat_xyzw": [round(float(q), 5) for q in quat],
    }


def presence_events(name: str, frames: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Entry, exit, occlusion and reappearance of one object, by time.

    Args:
        name: The object.
        frames: From `frame_truth`, one for each frame.

    Returns:
        Records of ``kind``, ``object``, ``frame``.
    """
    max_area = max(f[name]["amodal_px"] for f in frames)
    events: list[dict[str, Any]] = []
    inside = hidden = False
    for frame in frames:
        area, visible = frame[name]["amodal_px"], frame[name]["visible_px"]
        now_inside = area > 0 and area >= MIN_ENTERED_SHARE * max_area
        if now_inside != inside:
            inside, hidden = now_inside, False
            events.append(
                {"kind": "entry" if inside else "exit", "object": name, "frame": frame["index"]}
            )
        now_hidden = inside and visible < (VISIBLE_ABOVE if hidden else OCCLUDED_BELOW) * area
        if now_hidden != hidden:
            hidden = now_hidden
            kind = "occlusion" if hidden else "reappearance"
            events.append({"kind": kind, "object": name, "frame": frame["index"]})
    return events


def spin_deg_per_s(renderer: Renderer, name: str) -> float:
    """Rate of rotation of an object in the world at the end of the scenario, degrees per second."""
    scenario = renderer.scenario
    item = next(o for o in scenario.object if o.name == name)
    last, step = scenario.duration_s, 1.0 / scenario.camera.fps
    a, b = (
        Rotation.from_matrix(renderer.scene.object_pose(item, t)[:3, :3])
        for t in (last - step, last)
    )
    return round(float(np.degrees((b * a.inv()).magnitude()) / step), 4)


def mission_truth(renderer: Renderer, frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The content of ``truth.json``.

    Args:
        renderer: Renderer of the scenario.
        frames: From `frame_truth`, one for each frame.

    Returns:
        A JSON-like record.
    """
    scenario, truth = renderer.scenario, renderer.scenario.truth
    fps = scenario.camera.fps
    events = [e for o in scenario.labelled for e in presence_events(o.name, frames)]
    events += [
        {"kind": c.kind, "objects": list(c.objects), "frame": round(c.at_s * fps)}
        for c in truth.coupling
    ]
    return {
        "name": scenario.name,
        "fps": fps,
        "size": list(scenario.camera.size),
        "labels": {o.name: o.label for o in scenario.labelled},
        "meshes": {o.name: o.model or o.mesh for o in scenario.labelled},
        "task": scenario.task,
        "events": sorted(events, key=lambda e: e["frame"]),
        "stages": [s.model_dump() for s in truth.stage],
        "alerts": [_alert(a.model_dump()) for a in truth.alert],
        "verdict": truth.verdict,
        "spin_deg_per_s": spin_deg_per_s(renderer, truth.spin_of) if truth.spin_of else 0.0,
        "frames": list(frames),
    }


def mission(scenario: Scenario) -> dict[str, Any]:
    """The content of ``mission.json``: what a supervisor may know."""
    return {
        "task": scenario.task,
        "actors": {o.name: o.model or o.mesh for o in scenario.labelled if o.actor},
        "fov_vertical_deg": scenario.camera.at(0.0).fov_vertical_deg,
        "fps": scenario.camera.fps,
        "size": list(scenario.camera.size),
    }


def _alert(record: dict[str, Any]) -> dict[str, Any]:
    return {k: list(v) if k == "objects" else v for k, v in record.items() if k != "objects" or v}
