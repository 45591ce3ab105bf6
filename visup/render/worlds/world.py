"""The records of a random world: bodies with a pose for every frame, light, camera and ground truth.

World coordinates are right-handed with z up, in metres; the floor or table is at z = 0. Motion is sampled: a
moving body has one pose for each frame, so the renderer does not depend on how a kind simulates it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Solid

Floats = NDArray[np.float32]
Poses = NDArray[np.float64]
FPS = 15
SIZE = (480, 360)
"""Width and height in pixels, as in the shared worlds."""


@dataclass(frozen=True, slots=True)
class Surface:
    """The texture of a body.

    Attributes:
        pattern: One of those in `surfaces.py`.
        size: Size of the largest features of the pattern, metres.
        contrast: 0 to 1.
        seed: Chooses the pattern.
        second: Reflectance (red, green, blue) that the pattern mixes in; None for a darker shade of the
            first.
    """

    pattern: str = "grain"
    size: float = 0.3
    contrast: float = 0.15
    seed: int = 0
    second: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RigidBody:
    """A solid and its pose in each frame.

    Attributes:
        name: Its name; bodies that share a name and a label are one object, such as the links of an arm.
        solid: Its mesh.
        poses: (F, 4, 4) from the solid's frame to the world's, or (1, 4, 4) if static.
        label: Value in masks; 0 for scenery.
        surface: Its pattern.
    """

    name: str
    solid: Solid
    poses: Poses
    label: int = 0
    surface: Surface = Surface()

    @property
    def moves(self) -> bool:
        """Whether it has a pose for each frame."""
        return len(self.poses) > 1


@dataclass(frozen=True, slots=True)
class Daylight:
    """A distant sun and ambient light.

    Attributes:
        sun: Direction to the sun, unit.
        sun_colour: Radiance of a white surface perpendicular to it, red, green, blue.
        ambient: Radiance of a white surface that faces up in shadow, red, green, blue.
        softness_px: Standard deviation of the blur of shadow edges.
    """

    sun: tuple[float, float, float]
    sun_colour: tuple[float, float, float] = (0.8, 0.78, 0.72)
    ambient: tuple[float, float, float] = (0.34, 0.36, 0.4)
    softness_px: float = 1.0


@dataclass(frozen=True, slots=True)
class Sky:
    """The sky.

    Attributes:
        zenith: Colour overhead, red, green, blue.
        horizon: Colour at the horizon.
        clouds: Share of white that clouds mix in, 0 to 1.
        seed: Seed of the clouds.
    """

    zenith: tuple[float, float, float] = (0.25, 0.42, 0.75)
    horizon: tuple[float, float, float] = (0.7, 0.78, 0.85)
    clouds: float = 0.5
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Water:
    """Water at z = 0.

    Attributes:
        colour: Reflectance when seen from above, red, green, blue.
        waves: (N, 4): wave numbers along x and y (radians per metre), angular speed (radians per second)
            and steepness of each wave.
    """

    colour: tuple[float, float, float]
    waves: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """A camera at a fixed position that rotates about its pinhole.

    Attributes:
        position: Metres.
        look_at: The point in the centre of the image without rotation.
        fov_vertical_deg: Vertical field of view at zoom 1.
        rotations_deg: (F, 3) degrees of pan, tilt and roll in each frame.
        zoom: (F,) magnification in each frame.
        style: fixed, shaking, panning or zooming.
    """

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov_vertical_deg: float
    rotations_deg: NDArray[np.float64]
    zoom: NDArray[np.float64]
    style: str = "fixed"


@dataclass(frozen=True, slots=True)
class CameraSensor:
    """The sensor of the camera.

    Attributes:
        exposure: Factor on all light.
        noise: Standard deviation, of 255.
        blur_px: Blur of the lens.
        jpeg: Quality, 0 to 100, with which each image is compressed before it enters the video.
    """

    exposure: float = 1.0
    noise: float = 2.0
    blur_px: float = 0.5
    jpeg: int = 85


@dataclass(frozen=True, slots=True)
class StageSpan:
    """The time and the outcome of a stage of the task.

    Attributes:
        stage: Its name in the task file.
        from_s: When it began.
        to_s: When it ended, or the end of the clip.
        outcome: `complete`, `failing` or `unsafe`; `complete` also if the clip ends first.
    """

    stage: str
    from_s: float
    to_s: float
    outcome: str = "complete"


@dataclass(frozen=True, slots=True)
class Contact:
    """Two actors touch in space, from a time to a time in seconds."""

    a: str
    b: str
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class Motion:
    """An actor moves, from a time to a time in seconds."""

    what: str
    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class TaskTruth:
    """The ground truth of a task, as a careful observer would annotate it.

    Attributes:
        outcome: One of the outcomes of its kind, such as `ok` or `drop`.
        verdict: `succeeded`, `failed`, `interrupted` or `in_progress`.
        stages: In order of time.
        accept: All defensible verdicts; empty for the verdict alone.
        contacts: Contacts between actors.
        moves: Motions of actors.
        alerts: Kind of violated invariant -> since when, seconds.
    """

    outcome: str
    verdict: str
    stages: tuple[StageSpan, ...]
    accept: tuple[str, ...] = ()
    contacts: tuple[Contact, ...] = ()
    moves: tuple[Motion, ...] = ()
    alerts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class World:
    """A random world.

    Attributes:
        name: Name of its folder.
        kind: Kind of machine at work.
        bodies: Its static and moving bodies.
        viewpoint: The camera.
        light: The light.
        sky: The sky.
        sensor: The sensor.
        task: Name of its task file, without suffix.
        task_text: The task in visup's language.
        actors: Actor of the task -> name of the body.
        truth: Ground truth.
        frames: Number of frames.
        water: The water, if there is any.
        seed: Seed of the noise.
        size: Width and height in pixels.
    """

    name: str
    kind: str
    bodies: tuple[RigidBody, ...]
    viewpoint: Viewpoint
    light: Daylight
    sky: Sky
    sensor: CameraSensor
    task: str
    task_text: str
    actors: Mapping[str, str]
    truth: TaskTruth
    frames: int
    water: Water | None = None
    seed: int = 0
    size: tuple[int, int] = SIZE

    @property
    def labels(self) -> dict[str, int]:
        """Labelled objects and their values in masks, in order of these."""
        found = {t.name: t.label for t in self.bodies if t.label}
        return dict(sorted(found.items(), key=lambda item: item[1]))
