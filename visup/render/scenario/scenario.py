"""Format of scenario files: objects, motion, light and ground truth of a scene.

``docs/scenarios.md`` describes it. World coordinates are metres, right-handed; times are seconds.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError, model_validator

from visup.agent.model.errors import ErrorGroup, SettingsError, SourceLocation, VisupError
from visup.agent.storage.text_file import read_text_file
from visup.render.scenario.optics import (
    Camera,
    Direction,
    Earth,
    Light,
    Panorama,
    ScenarioModel,
    Seconds,
    Sensor,
    Stars,
    Texture,
    Vector,
    check_increasing,
)


class PoseKey(ScenarioModel):
    """The pose of an object at a time, with at most one form of orientation; none is the identity."""

    at_s: Seconds = 0.0
    position: Vector
    euler_deg: Vector | None = None
    quat_xyzw: tuple[float, float, float, float] | None = None

    @model_validator(mode="after")
    def _one_orientation(self) -> PoseKey:
        if self.euler_deg is not None and self.quat_xyzw is not None:
            raise ValueError("give euler_deg or quat_xyzw, not both")
        if self.quat_xyzw is not None and not any(self.quat_xyzw):
            raise ValueError("a quaternion must not be zero")
        return self


class TipKey(ScenarioModel):
    """The position of an arm's tip at a time, and the direction of its end effector (world)."""

    at_s: Seconds = 0.0
    position: Vector
    direction: Direction


class JointKey(ScenarioModel):
    """The six joint angles of an arm at a time, degrees, from the shoulder to the tip."""

    at_s: Seconds = 0.0
    angles_deg: tuple[float, float, float, float, float, float]


class SteadyRotation(ScenarioModel):
    """A constant rotation about a world axis from a time on, added to the track."""

    axis: Direction
    deg_per_s: float
    from_s: Seconds = 0.0


Keys = Annotated[tuple[PoseKey, ...], Field(min_length=1), AfterValidator(check_increasing)]


class Attachment(ScenarioModel):
    """A rigid attachment to another object from a time on (to the tip, when that is an arm)."""

    to: str
    from_s: Seconds


class SceneObject(ScenarioModel):
    """An object of the scene: a rigid body on a track, or an arm driven by its tip or its joints.

    Objects with label 0 are scenery: visible, but part of the background.
    """

    name: Annotated[str, Field(min_length=1)]
    mesh: Annotated[str, Field(min_length=1)]
    label: Annotated[int, Field(ge=0, le=255)] = 0
    model: str | None = None
    actor: bool = False
    colour: tuple[float, float, float] | None = None
    texture: Texture | None = None
    scale: Annotated[float, Field(gt=0)] = 1.0
    smooth: bool = False
    track: Keys
    spin: tuple[SteadyRotation, ...] = ()
    attach: Attachment | None = None
    tip: Annotated[tuple[TipKey, ...], AfterValidator(check_increasing)] = ()
    joints: Annotated[tuple[JointKey, ...], AfterValidator(check_increasing)] = ()
    roll_deg: float = 0.0
    elbow_up: bool = True

    @model_validator(mode="after")
    def _consistent(self) -> SceneObject:
        if self.label == 128:
            raise ValueError("label 128 means 'not scored' in masks; choose another")
        drivers = bool(self.tip) + bool(self.joints)
        if self.mesh == "arm" and drivers != 1:
            raise ValueError("an arm needs either tip or joints keys")
        if self.mesh != "arm" and drivers:
            raise ValueError("only the mesh 'arm' has tip or joints keys")
        if self.mesh == "arm" and self.texture:
            raise ValueError("an arm bends, and a texture is that of a rigid body")
        return self


class StageTruth(ScenarioModel):
    """A stage that a supervisor should report, and its outcome."""

    stage: str
    from_s: Seconds
    to_s: Seconds
    outcome: Literal["complete", "failing", "unsafe"]


class AlertTruth(ScenarioModel):
    """An alert that a supervisor should raise."""

    kind: str
    from_s: Seconds
    objects: tuple[str, ...] = ()


class CouplingTruth(ScenarioModel):
    """Two objects couple or decouple."""

    kind: Literal["coupled", "decoupled"]
    objects: tuple[str, str]
    at_s: Seconds


class ScenarioTruth(ScenarioModel):
    """Ground truth that the geometry does not give."""

    verdict: Literal["succeeded", "failed", "interrupted", "in_progress"] = "in_progress"
    stage: tuple[StageTruth, ...] = ()
    alert: tuple[AlertTruth, ...] = ()
    coupling: tuple[CouplingTruth, ...] = ()
    spin_of: str | None = None


class Scenario(ScenarioModel):
    """A whole scenario file."""

    name: Annotated[str, Field(pattern=r"^[\w-]+$")]
    task: str = "dock"
    duration_s: Annotated[float, Field(gt=0, le=3600)]
    seed: int = 0
    camera: Camera
    light: Light
    background: Annotated[Stars | Earth | Panorama, Field(discriminator="kind")] = Stars()
    sensor: Sensor = Sensor()
    object: Annotated[tuple[SceneObject, ...], Field(min_length=1)]
    truth: ScenarioTruth = ScenarioTruth()

    @property
    def frame_count(self) -> int:
        """Number of frames of the video."""
        return max(1, round(self.duration_s * self.camera.fps))

    @property
    def labelled(self) -> tuple[SceneObject, ...]:
        """The objects with a label, without scenery."""
        return tuple(o for o in self.object if o.label)

    def resized(self, size: tuple[int, int]) -> Scenario:
        """The same scene at another image size; the vertical field of view is unchanged."""
        return self.model_copy(update={"camera": self.camera.model_copy(update={"size": size})})

    @model_validator(mode="after")
    def _check_names(self) -> Scenario:
        names = [o.name for o in self.object]
        labels = [str(o.label) for o in self.labelled]
        for kind, values in (("name", names), ("label", labels)):
            duplicates = sorted({w for w in values if values.count(w) > 1})
            if duplicates:
                raise ValueError(f"two objects have the {kind} {duplicates[0]!r}")
        known = set(names)
        references = [o.attach.to for o in self.object if o.attach]
        references += [n for c in self.truth.coupling for n in c.objects]
        references += [n for a in self.truth.alert for n in a.objects]
        references += [self.truth.spin_of] if self.truth.spin_of else []
        for name in references:
            if name not in known:
                raise ValueError(f"there is no object {name!r}; there are {', '.join(names)}")
        self._check_attachment_cycles()
        return self

    def _check_attachment_cycles(self) -> None:
        to = {o.name: o.attach.to for o in self.object if o.attach}
        for start in to:
            at, seen = start, {start}
            while at in to:
                at = to[at]
                if at in seen:
                    raise ValueError(f"{start!r} is attached to itself, through others")
                seen.add(at)


def load_scenario(path: Path) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: A TOML file.

    Returns:
        The scenario.

    Raises:
        SettingsError: The file cannot be read, is not TOML, or has one error.
        ErrorGroup: It has several.
    """
    try:
        text = read_text_file(path)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not a text file"
        raise SettingsError(
            f"the scenario cannot be read: {reason}", where=str(path), expected="a scenario in TOML"
        ) from error
    return _with_mesh_paths(parse_scenario(text, str(path)), path.parent)


def parse_scenario(text: str, name: str = "scenario") -> Scenario:
    """Check the text of a scenario; `name` stands in messages. Raises as `load_scenario`."""
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SettingsError(
            f"this is not TOML: {error}", where=name, expected="a scenario in TOML"
        ) from error
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        faults: list[VisupError] = [_fault(e, name, text) for e in _root_faults(error)]
        raise (faults[0] if len(faults) == 1 else ErrorGroup(faults)) from error


def _with_mesh_paths(scenario: Scenario, folder: Path) -> Scenario:
    """The scenario with the paths of its mesh files relative to its own file."""
    items = [
        o.model_copy(update={"mesh": str(folder / o.mesh)}) if Path(o.mesh).suffix else o
        for o in scenario.object
    ]
    return scenario.model_copy(update={"object": tuple(items)})


def _root_faults(error: ValidationError) -> list[dict[str, Any]]:
    """The root errors, without consequential ones: a list is 'too short' once its items are rejected."""
    found: list[dict[str, Any]] = [dict(e) for e in error.errors()]
    paths = [e["loc"] for e in found]
    return [
        e for e in found if not any(p != e["loc"] and p[: len(e["loc"])] == e["loc"] for p in paths)
    ]


def _fault(error: dict[str, Any], name: str, text: str) -> SettingsError:
    """A pydantic error in the user's terms."""
    path = [
        s for s in error["loc"] if s not in ("stars", "earth", "panorama") or len(error["loc"]) == 1
    ]
    where = ".".join(str(s + 1) if isinstance(s, int) else str(s) for s in path)
    message = str(error["msg"]).removeprefix("Value error, ").rstrip(".")
    if error["type"] == "extra_forbidden":
        message = "there is no such setting"
    if error["type"] == "missing":
        message = "this setting is missing"
    return SettingsError(
        f"{where}: {message}" if where else message,
        where=_key_location(name, text, path) or name,
        hint="docs/scenarios.md lists every setting",
    )


def _key_location(name: str, text: str, path: list[Any]) -> SourceLocation | None:
    """The line of a key, if it occurs only once in the file."""
    keys = [s for s in path if isinstance(s, str)]
    if not keys:
        return None
    key = keys[-1]
    found = [
        (n, line)
        for n, line in enumerate(text.splitlines(), 1)
        if line.split("=")[0].strip(" [].") == key
    ]
    if len(found) != 1:
        return None
    number, line = found[0]
    return SourceLocation(name, number, line.index(key) + 1, line, len(key))
