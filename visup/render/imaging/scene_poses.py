"""Poses of a scenario at a time: the camera, the objects, the joints of arms."""

from __future__ import annotations

from math import radians

import numpy as np
from scipy.spatial.transform import Rotation

from visup.agent.model.errors import SettingsError
from visup.render.imaging.raycast import Body
from visup.render.meshes import arm as arm_model
from visup.render.meshes.solids import Solid
from visup.render.meshes.spacecraft import mesh
from visup.render.scenario.scenario import PoseKey, Scenario, SceneObject
from visup.render.scenario.trajectories import (
    Matrix,
    camera_shake,
    inverse,
    look_at,
    pose_of,
    rotation_about,
    rotation_at,
    value_at,
)


class PosedScene:
    """Poses of the camera and the bodies of a scenario at any time.

    Args:
        scenario: The scenario.

    Raises:
        SettingsError: A mesh is missing.
    """

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.objects = {o.name: o for o in scenario.object}
        self.solids = {o.name: _solid(o) for o in scenario.object if o.mesh != "arm"}

    def camera_pose(self, time: float) -> Matrix:
        """(4, 4) from the camera's frame to the world's."""
        settings = self.scenario.camera
        keys = settings.track
        times = np.array([k.at_s for k in keys])
        columns = np.array([[*k.position, *k.look_at, *k.up] for k in keys])
        values = value_at(times, columns, time, settings.smooth)
        rotation = look_at(values[:3], values[3:6], values[6:])
        if settings.shake is not None:
            s = settings.shake
            rotation = rotation * camera_shake(time, s.amplitude_deg, s.frequency_hz, s.seed)
        return pose_of(values[:3], rotation)

    def bodies(self, time: float, camera: Matrix) -> list[Body]:
        """All objects, in the camera's frame."""
        to_camera = inverse(camera)
        posed = []
        for item in self.scenario.object:
            solid = self.solids.get(item.name) or self._arm_solid(item, time)
            posed.append(
                Body(item.name, item.label, solid, to_camera @ self.object_pose(item, time))
            )
        return posed

    def object_pose(self, item: SceneObject, time: float) -> Matrix:
        """(4, 4) from an object's frame to the world's; for an arm, that of its foot."""
        if item.attach is not None and time > item.attach.from_s:
            carrier, since = self.objects[item.attach.to], item.attach.from_s
            relative = inverse(self.attachment_frame(carrier, since)) @ self.object_pose(
                item, since
            )
            return np.asarray(self.attachment_frame(carrier, time) @ relative)
        return track_pose(item, time)

    def attachment_frame(self, item: SceneObject, time: float) -> Matrix:
        """The frame in which attached objects are at rest."""
        pose = self.object_pose(item, time)
        return pose @ arm_model.tip_pose(self._joints(item, time)) if item.mesh == "arm" else pose

    def _joints(self, item: SceneObject, time: float) -> arm_model.Joints:
        if item.joints:
            times = np.array([k.at_s for k in item.joints])
            angles = np.radians([k.angles_deg for k in item.joints])
            return arm_model.Joints(*value_at(times, angles, time, item.smooth))
        times = np.array([k.at_s for k in item.tip])
        columns = np.array([[*k.position, *k.direction] for k in item.tip])
        values = value_at(times, columns, time, item.smooth)
        from_world = inverse(track_pose(item, time))
        tip = from_world[:3, :3] @ values[:3] + from_world[:3, 3]
        try:
            return arm_model.inverse_kinematics(
                tip, from_world[:3, :3] @ values[3:], radians(item.roll_deg), item.elbow_up
            )
        except SettingsError as error:
            raise SettingsError(
                f"{item.name} at {time:.2f} s: {error.what}", expected=error.expected
            ) from error

    def _arm_solid(self, item: SceneObject, time: float) -> Solid:
        return _coloured(arm_model.arm_solid(self._joints(item, time)), item)


def track_pose(item: SceneObject, time: float) -> Matrix:
    """(4, 4) world pose of an object from its keyframes and spins alone."""
    keys = item.track
    times = np.array([k.at_s for k in keys])
    position = value_at(times, np.array([k.position for k in keys]), time, item.smooth)
    rotation = rotation_at(times, Rotation.concatenate([_orientation(k) for k in keys]), time)
    for spin in item.spin:
        angle_deg = spin.deg_per_s * max(0.0, time - spin.from_s)
        rotation = rotation_about(np.asarray(spin.axis, float), angle_deg) * rotation
    return pose_of(position, rotation)


def _orientation(key: PoseKey) -> Rotation:
    if key.quat_xyzw is not None:
        return Rotation.from_quat(key.quat_xyzw)
    return Rotation.from_euler("xyz", key.euler_deg or (0.0, 0.0, 0.0), degrees=True)


def _solid(item: SceneObject) -> Solid:
    return _coloured(mesh(item.mesh), item)


def _coloured(solid: Solid, item: SceneObject) -> Solid:
    coloured = solid.painted(item.colour) if item.colour is not None else solid
    return coloured if item.scale == 1.0 else coloured.moved(scale=item.scale)
