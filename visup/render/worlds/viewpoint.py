"""Camera geometry: rotations, focal lengths, rays, and camera motions."""

from __future__ import annotations

from math import radians, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from visup.render.scenario.trajectories import look_at
from visup.render.worlds.motion import eased, frame_times
from visup.render.worlds.world import FPS, Floats, Viewpoint

Doubles = NDArray[np.float64]
WORLD_UP = np.array([0.0, 0.0, 1.0])


def base_rotation(view: Viewpoint) -> Doubles:
    """(3, 3) from the frame of the camera at rest (x right, y down, z forward) to the world's."""
    ahead = np.subtract(view.look_at, view.position)
    looks_down = abs(ahead[2]) > 0.995 * float(np.linalg.norm(ahead))
    up = np.array([0.0, 1.0, 0.0]) if looks_down else WORLD_UP
    turned = look_at(np.asarray(view.position), np.asarray(view.look_at), up)
    return np.asarray(turned.as_matrix(), float)


def frame_rotation(view: Viewpoint, index: int) -> Doubles:
    """(3, 3) from the camera's frame in a frame of the clip to that of the camera at rest."""
    pan, tilt, roll = np.radians(view.rotations_deg[index])
    return np.asarray(Rotation.from_euler("YXZ", [pan, tilt, roll]).as_matrix(), float)


def focal_px(view: Viewpoint, height: int, zoom: float = 1.0) -> float:
    """Focal length in pixels for an image height."""
    return zoom * height / 2 / tan(radians(view.fov_vertical_deg) / 2)


def rays(width: int, height: int, focal: float, points: Doubles | None = None) -> Floats:
    """(N, 3) float32 in the camera's frame, z = 1, through all pixels or through points (x, y)."""
    if points is None:
        y, x = np.mgrid[:height, :width]
        points = np.column_stack([x.ravel(), y.ravel()]).astype(float)
    flat = (points - [(width - 1) / 2, (height - 1) / 2]) / focal
    return np.column_stack([flat, np.ones(len(flat))]).astype(np.float32)


def project(view: Viewpoint, points: ArrayLike, size: tuple[int, int]) -> Doubles:
    """(N, 2) pixels of world points (N, 3) in front of the camera at rest."""
    in_camera = (np.atleast_2d(np.asarray(points, float)) - view.position) @ base_rotation(view)
    middle = np.array([(size[0] - 1) / 2, (size[1] - 1) / 2])
    return np.asarray(in_camera[:, :2] / in_camera[:, 2:] * focal_px(view, size[1]) + middle)


def sees_all(
    view: Viewpoint, points: ArrayLike, size: tuple[int, int], margin: float = 0.06
) -> bool:
    """Whether the camera at rest sees all points, with a margin as a share of the image."""
    position = project(view, points, size) / size
    return bool(((position > margin) & (position < 1 - margin)).all())


def first_in_view(view: Viewpoint, path: ArrayLike, size: tuple[int, int]) -> int | None:
    """The first frame in which the camera at rest sees a moving point, (F, 3) metres; None if never."""
    position = project(view, path, size)
    inside = ((position > 0) & (position < np.array(size))).all(axis=1)
    return int(np.argmax(inside)) if inside.any() else None


def fixed_camera(
    position: ArrayLike, aim: ArrayLike, fov_vertical_deg: float, frames: int
) -> Viewpoint:
    """A camera on a tripod; position and aim are (3,), metres."""
    (x, y, z), (a, b, c) = np.asarray(position, float).tolist(), np.asarray(aim, float).tolist()
    zero, one = np.zeros((frames, 3)), np.ones(frames)
    return Viewpoint((x, y, z), (a, b, c), fov_vertical_deg, zero, one, "fixed")


def with_camera_motion(view: Viewpoint, rng: np.random.Generator, style: str) -> Viewpoint:
    """The same camera with another motion.

    Args:
        view: On a tripod.
        rng: Draws amplitudes and times.
        style: `fixed`, `shaking`, `panning` or `zooming`.

    Returns:
        A viewpoint that keeps the centre of the scene in view.
    """
    frames = len(view.zoom)
    fov_deg = view.fov_vertical_deg
    rotations_deg, zoom = view.rotations_deg, view.zoom
    if style == "shaking":
        rotations_deg = _jitter(rng, frames, rng.uniform(0.004, 0.016) * fov_deg)
    elif style == "panning":
        rotations_deg = _jitter(rng, frames, 0.002 * fov_deg) + _pan(rng, frames, fov_deg)
    elif style == "zooming":
        zoom = _zoom(rng, frames)
    return Viewpoint(view.position, view.look_at, view.fov_vertical_deg, rotations_deg, zoom, style)


def _jitter(rng: np.random.Generator, frames: int, degrees: float) -> Doubles:
    """(F, 3): handheld shake; slow sway and quick tremor, little roll."""
    white = rng.standard_normal((frames + 40, 3))
    slow = gaussian_filter1d(white, 0.45 * FPS, axis=0)[20:-20]
    quick = gaussian_filter1d(white[:, ::-1], 0.1 * FPS, axis=0)[20:-20]
    mix = slow / slow.std() + 0.35 * quick / quick.std()
    return np.asarray(degrees * mix * [1.0, 1.0, 0.4])


def _pan(rng: np.random.Generator, frames: int, fov_deg: float) -> Doubles:
    """(F, 3): the camera turns to one side, or there and back."""
    t = frame_times(frames)
    end = t[-1]
    reach = rng.choice([-1, 1]) * rng.uniform(0.08, 0.2) * fov_deg
    a, b = end * rng.uniform(0.05, 0.3), end * rng.uniform(0.5, 0.9)
    back = rng.choice([-1.0, 0.0, 1.0])
    pan = eased(t, [(a, -reach / 2), ((a + b) / 2, reach / 2), (b, -back * reach / 2)])
    return np.column_stack([pan, 0.15 * pan, np.zeros(frames)])


def _zoom(rng: np.random.Generator, frames: int) -> Doubles:
    t = frame_times(frames)
    max_zoom = rng.uniform(1.12, 1.35)
    a, b = t[-1] * rng.uniform(0.05, 0.3), t[-1] * rng.uniform(0.45, 0.9)
    first, last = (1.0, max_zoom) if rng.random() < 0.6 else (max_zoom, 1.0)
    return eased(t, [(a, first), (b, last)])
