"""What a random world is made of: things with a pose for every frame, light, a camera, and its truth.

World coordinates are right-handed with z up, in metres; the floor or table stands at z = 0. Everything is
sampled: a thing that moves has one pose for each frame, so that kinds may simulate as they please and the
renderer needs to know nothing of it.
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
    """How a thing's reflectance varies over it.

    Attributes:
        pattern: One of those in `surfaces.py`.
        size: Metres of the largest features of the pattern.
        contrast: 0 to 1.
        seed: Chooses the pattern.
        second: Reflectance (red, green, blue) that the pattern mixes in; a darker first one when None.
    """

    pattern: str = "grain"
    size: float = 0.3
    contrast: float = 0.15
    seed: int = 0
    second: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """A solid and where it is in each frame.

    Attributes:
        name: Its name; things that share a name and a label are one object, such as the links of an arm.
        solid: Its mesh.
        poses: (F, 4, 4) from the solid's frame to the world's, or (1, 4, 4) for what never moves.
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
    """One distant lamp and what the surroundings throw back.

    Attributes:
        sun: The way to the lamp, unit.
        sun_colour: Radiance of a white surface square to it, red, green, blue.
        ambient: Radiance of a white surface that faces up and lies in shadow, red, green, blue.
        softness_px: Standard deviation by which edges of shadows are blurred.
    """

    sun: tuple[float, float, float]
    sun_colour: tuple[float, float, float] = (0.8, 0.78, 0.72)
    ambient: tuple[float, float, float] = (0.34, 0.36, 0.4)
    softness_px: float = 1.0


@dataclass(frozen=True, slots=True)
class Heaven:
    """What is seen where nothing stands.

    Attributes:
        zenith: Reflected colour overhead, red, green, blue.
        horizon: And at the horizon.
        clouds: Share of white that clouds mix in, 0 to 1.
        seed: Of the clouds.
    """

    zenith: tuple[float, float, float] = (0.25, 0.42, 0.75)
    horizon: tuple[float, float, float] = (0.7, 0.78, 0.85)
    clouds: float = 0.5
    seed: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Water:
    """Water at z = 0 wherever nothing stands before it.

    Attributes:
        colour: Reflectance when seen from above, red, green, blue.
        waves: (N, 4): wave numbers along x and y (radians per metre), angular speed (radians per second)
            and steepness of each wave.
    """

    colour: tuple[float, float, float]
    waves: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """A camera that stands still and turns about its pinhole.

    Attributes:
        position: Metres.
        look_at: The point that is in the middle of an undisturbed picture.
        fov_vertical_deg: Vertical field of view at zoom 1.
        turns: (F, 3) degrees of pan, tilt and roll in each frame.
        zoom: (F,) magnification in each frame.
        style: In a word: fixed, shaking, panning or zooming.
    """

    position: tuple[float, float, float]
    look_at: tuple[float, float, float]
    fov_vertical_deg: float
    turns: NDArray[np.float64]
    zoom: NDArray[np.float64]
    style: str = "fixed"


@dataclass(frozen=True, slots=True)
class Imager:
    """What the camera makes of the light.

    Attributes:
        exposure: Factor on all light.
        noise: Standard deviation, of 255.
        blur_px: Of the lens.
        jpeg: Quality, 0 to 100, at which each picture is stored before it goes into the video.
    """

    exposure: float = 1.0
    noise: float = 2.0
    blur_px: float = 0.5
    jpeg: int = 85


@dataclass(frozen=True, slots=True)
class StageSpan:
    """A stage of the task as it went.

    Attributes:
        stage: Its name in the task file.
        from_s: When it began.
        to_s: When it was over, or when the clip ends.
        outcome: `complete`, `failing` or `unsafe`; `complete` as well where the clip ends before it does.
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
class Course:
    """How a task went: what a careful person would note.

    Attributes:
        outcome: The way it went, one of its kind's, such as `ok` or `drop`.
        verdict: `succeeded`, `failed`, `interrupted` or `in_progress`.
        stages: In order of time.
        accept: All verdicts that can be defended; the verdict alone when empty.
        contacts: Between actors.
        moves: Of actors.
        alerts: Kind of invariant that is broken -> since when, seconds.
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
    """All of a random world.

    Attributes:
        name: Of its folder.
        kind: Of machine at work.
        things: What stands and moves in it.
        viewpoint: The camera.
        light: The light.
        heaven: The sky.
        imager: What the camera makes of it.
        task: Name of its task file, without suffix.
        task_text: The task in visup's language.
        actors: Actor of the task -> name of the thing.
        course: What is true.
        frames: How many there are.
        water: If there is any.
        seed: Of noise.
        size: Width and height in pixels.
    """

    name: str
    kind: str
    things: tuple[Thing, ...]
    viewpoint: Viewpoint
    light: Daylight
    heaven: Heaven
    imager: Imager
    task: str
    task_text: str
    actors: Mapping[str, str]
    course: Course
    frames: int
    water: Water | None = None
    seed: int = 0
    size: tuple[int, int] = SIZE

    @property
    def labels(self) -> dict[str, int]:
        """Labelled objects and their values in masks, in order of these."""
        found = {t.name: t.label for t in self.things if t.label}
        return dict(sorted(found.items(), key=lambda item: item[1]))
