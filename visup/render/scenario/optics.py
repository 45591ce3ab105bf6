"""Imaging settings of a scenario: camera, light, background, sensor.

Settings that change over time (zoom, light strength, exposure) have keyframes and an `at`, which returns the
settings at a given time.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

Vector = tuple[float, float, float]


def _not_zero(v: Vector) -> Vector:
    if not any(v):
        raise ValueError("a direction must not be zero")
    return v


Direction = Annotated[Vector, AfterValidator(_not_zero)]
Seconds = Annotated[float, Field(ge=0)]


class ScenarioModel(BaseModel):
    """Immutable settings that reject unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def check_increasing(keys: tuple[Any, ...]) -> tuple[Any, ...]:
    """Keyframes whose times rise."""
    times = [k.at_s for k in keys]
    if any(b <= a for a, b in pairwise(times)):
        raise ValueError("at_s must rise from key to key")
    return keys


class CameraKey(ScenarioModel):
    """Where the camera is at a time, and the point it looks at."""

    at_s: Seconds = 0.0
    position: Vector
    look_at: Vector
    up: Direction = (0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _has_line_of_sight(self) -> CameraKey:
        line_of_sight = np.subtract(self.look_at, self.position)
        if np.linalg.norm(np.cross(line_of_sight, self.up)) < 1e-9:
            raise ValueError(
                "look_at must differ from position, and up must not lie along the line of sight"
            )
        return self


class Shake(ScenarioModel):
    """Camera shake, as of an unsteady hand."""

    amplitude_deg: Annotated[float, Field(ge=0, le=5)]
    frequency_hz: Annotated[float, Field(gt=0, le=50)] = 1.0
    seed: int = 0


FieldOfView = Annotated[float, Field(gt=0.1, lt=170)]
Exposure = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0)]


class ZoomKey(ScenarioModel):
    """The vertical field of view at a time."""

    at_s: Seconds = 0.0
    fov_vertical_deg: FieldOfView


class LightKey(ScenarioModel):
    """The strength of the light at a time."""

    at_s: Seconds = 0.0
    strength: Share


class ExposureKey(ScenarioModel):
    """The exposure of the sensor at a time."""

    at_s: Seconds = 0.0
    exposure: Exposure


class Camera(ScenarioModel):
    """The camera and its track."""

    size: tuple[Annotated[int, Field(ge=16, le=8192)], Annotated[int, Field(ge=16, le=8192)]] = (
        640,
        480,
    )
    fps: Annotated[float, Field(gt=0, le=1000)] = 25.0
    fov_vertical_deg: FieldOfView = 38.0
    track: Annotated[tuple[CameraKey, ...], Field(min_length=1), AfterValidator(check_increasing)]
    shake: Shake | None = None
    smooth: bool = False
    zoom: Annotated[tuple[ZoomKey, ...], AfterValidator(check_increasing)] = ()

    def at(self, time: float) -> Camera:
        """The camera with its zoom at a time."""
        return _interpolated(self, self.zoom, "fov_vertical_deg", time)

    @property
    def focal_px(self) -> float:
        """Distance from the pinhole to the image, in pixels."""
        return float(self.size[1] / 2 / np.tan(np.radians(self.fov_vertical_deg) / 2))


class Light(ScenarioModel):
    """One distant sun, and the weak light of the Earth."""

    sun: Direction
    earth: Direction = (0.0, 0.0, -1.0)
    earthshine: Annotated[float, Field(ge=0, le=1)] = 0.05
    strength: Share = 1.0
    track: Annotated[tuple[LightKey, ...], AfterValidator(check_increasing)] = ()

    def at(self, time: float) -> Light:
        """The light with its strength at a time."""
        return _interpolated(self, self.track, "strength", time)


class Stars(ScenarioModel):
    """Stars, fixed in the world."""

    kind: Literal["stars"] = "stars"
    count: Annotated[int, Field(ge=0, le=100_000)] = 4000
    brightness: Annotated[float, Field(ge=0)] = 0.25
    seed: int = 0


class Earth(ScenarioModel):
    """A cloudy Earth with its limb in front of the stars; `light.earth` gives its direction."""

    kind: Literal["earth"]
    altitude_km: Annotated[float, Field(ge=100, le=40_000)] = 300.0
    clouds: Annotated[float, Field(ge=0, le=1)] = 0.5
    brightness: Annotated[float, Field(ge=0)] = 0.6
    turn_deg_per_s: float = 0.0
    turn_axis: Direction = (0.0, 1.0, 0.0)
    count: Annotated[int, Field(ge=0, le=100_000)] = 4000
    seed: int = 0


class Panorama(ScenarioModel):
    """A patterned surface far away on all sides; its pattern blends two colours."""

    kind: Literal["panorama"]
    colours: tuple[Vector, Vector] = ((0.10, 0.13, 0.12), (0.42, 0.38, 0.30))
    size_deg: Annotated[float, Field(gt=0, le=90)] = 6.0
    seed: int = 0


class Texture(ScenarioModel):
    """A solid texture, which extends through a body like the grain of wood."""

    contrast: Annotated[float, Field(ge=0, le=1)] = 0.5
    size: Annotated[float, Field(gt=0)] = 0.3
    seed: int = 0


class Sensor(ScenarioModel):
    """The response of the camera to light."""

    exposure: Exposure = 1.0
    track: Annotated[tuple[ExposureKey, ...], AfterValidator(check_increasing)] = ()
    gamma: Annotated[float, Field(ge=1, le=3)] = 2.2
    black: Annotated[float, Field(ge=0, le=100)] = 4.0
    noise: Annotated[float, Field(ge=0, le=64)] = 1.5
    blur_px: Annotated[float, Field(ge=0, le=10)] = 0.5

    def at(self, time: float) -> Sensor:
        """The sensor with its exposure at a time."""
        return _interpolated(self, self.track, "exposure", time)


Settings = TypeVar("Settings", Camera, Light, Sensor)


def _interpolated(settings: Settings, keys: tuple[Any, ...], name: str, time: float) -> Settings:
    """The settings with one number interpolated linearly between its keyframes, constant outside them."""
    if not keys:
        return settings
    value = np.interp(time, [k.at_s for k in keys], [getattr(k, name) for k in keys])
    return settings.model_copy(update={name: float(value)})
