"""Errors of reported poses: view direction and rotation rate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from visup.agent import Pose

Poses = Mapping[tuple[int, str], Pose]
"""(frame, true object) -> reported pose."""

SPIN_HALF_WINDOW_S = 0.5
"""The true rotation rate at a frame is measured over this time before and after, seconds."""


def view_error(truth: Mapping[str, Any], poses: Poses) -> float | None:
    """Median angle between reported and true direction, degrees; None without reports.

    The line of sight is taken through the centre of the box, and symmetric views count as errors, so the
    figure is an upper bound.

    Args:
        truth: Content of `truth.json`.
        poses: The reported poses.
    """
    width, height = truth["size"]
    fov = np.deg2rad(float(truth.get("fov_vertical_deg", 38.0)))
    focal = height / 2 / np.tan(fov / 2)
    angles = []
    for (index, name), pose in poses.items():
        true = truth["frames"][index].get(name, {})
        if "quat_xyzw" in true and "bbox" in true:
            angles.append(_angle(true, pose.direction, width, height, focal))
    return float(np.median(angles)) if angles else None


def spin_error(truth: Mapping[str, Any], poses: Poses) -> float | None:
    """Median difference between reported and true rotation rate, degrees per second, or None.

    Args:
        truth: Content of `truth.json`.
        poses: The reported poses.
    """
    errors = []
    for (index, name), pose in poses.items():
        true = true_spin(truth, index, name)
        if pose.spin is not None and true is not None:
            errors.append(abs(pose.spin.rate - true))
    return float(np.median(errors)) if errors else None


def true_spin(truth: Mapping[str, Any], index: int, name: str) -> float | None:
    """The true rotation rate of an object at a frame, degrees per second; None if not known.

    Args:
        truth: Content of `truth.json`.
        index: Number of the frame.
        name: The object.
    """
    from scipy.spatial.transform import Rotation

    frames = truth["frames"]
    half_window = round(SPIN_HALF_WINDOW_S * float(truth["fps"]))
    first, last = max(0, index - half_window), min(len(frames) - 1, index + half_window)
    ends = [frames[k].get(name, {}).get("quat_xyzw") for k in (first, last)]
    if None in ends or first == last:
        return None
    before, after = Rotation.from_quat(ends[0]), Rotation.from_quat(ends[1])
    seconds = (last - first) / float(truth["fps"])
    return float(np.degrees((after * before.inv()).magnitude()) / seconds)


def _angle(
    true: Mapping[str, Any],
    direction: tuple[float, float, float],
    width: int,
    height: int,
    focal: float,
) -> float:
    from scipy.spatial.transform import Rotation

    x, y, w, h = true["bbox"]
    ray = np.array([x + w / 2 - width / 2, y + h / 2 - height / 2, focal])
    to_viewer = Rotation.from_quat(true["quat_xyzw"]).inv().apply(-ray / np.linalg.norm(ray))
    cosine = float(np.clip(np.dot(to_viewer, direction), -1, 1))
    return float(np.rad2deg(np.arccos(cosine)))
