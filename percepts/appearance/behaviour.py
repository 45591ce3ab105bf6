"""The behaviour that reports a region for each taught or moving object, and names for the taught ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from visup.agent import (
    CameraMotion,
    Contract,
    Directive,
    Frame,
    Hypothesis,
    Observation,
    Percept,
    Region,
)
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.output.object_region import confidence, object_outline, object_region
from visup.percepts.appearance.output.severed_parts import (
    Support,
    joined,
    update_support,
    with_parts,
)
from visup.percepts.appearance.output.unexplained_regions import (
    moving_body,
    region_iou,
    unexplained,
)
from visup.percepts.appearance.tracking.track import TaughtObjectTrack
from visup.percepts.appearance.tracking.tracker import TaughtObjectTracker
from visup.percepts.motion.behaviour import MotionBehaviour, image_is_sound, image_is_trusted
from visup.percepts.motion.outlines.region_outline import RegionOutline
from visup.percepts.taught.lighting import relit_views
from visup.percepts.taught.taught_view import TaughtView

SAME_OBJECT_IOU = 0.4  # IoU from which a newly detected object takes over the id of a moving region


class AppearanceBehaviour:
    """Reports taught objects, at rest and in motion, other moving regions, and camera motion.

    Replaces the motion behaviour, which runs inside it: a moving region that is mainly a taught object is
    reported once, as that object.

    Args:
        taught: Views of objects; views of the same name are views of one object.
        motion: Segments independent motion.
    """

    contract = Contract(
        "appearance", gives=("region", "hypothesis", "camera"), hang_s=COMPILING_HANG_S
    )

    def __init__(
        self, taught: Sequence[TaughtView] = (), motion: MotionBehaviour | None = None
    ) -> None:
        self._taught = tuple(taught)
        self._motion = motion or MotionBehaviour()
        self._tracker = TaughtObjectTracker(view_models(taught))
        self._relit: tuple[tuple[int, TaughtView], ...] | None = None
        self._drawn: dict[str, tuple[Blob, RegionOutline | None]] = {}
        self._parts: Support = {}

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        tracker = self._tracker.save()
        return {
            "motion": self._motion.save(),
            "tracker": tracker,
            "relit": self._relit,
            "parts": self._parts,
        }

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        self._motion.load(state["motion"])
        self._add_relit_views(state["relit"])
        self._tracker.load(state["tracker"])
        self._parts = state["parts"]

    def missed(self, observation: Observation) -> None:
        """Reserve the ids of regions reported since the restored state."""
        self._motion.missed(observation)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the taught objects and the other moving regions of one frame.

        Args:
            frame: The next frame.
            observation: What was reported for this frame so far; nothing is reported unless its health is
                fully OK.
            directives: Requests from cogitation, passed on to motion segmentation.

        Returns:
            Percepts of kind 'camera', unless unknown; of kind 'region', by id; then of kind
            'hypothesis'.
        """
        moving = [p.value for p in self._motion.perceive(frame, observation, directives)]
        if not image_is_sound(observation):
            return []
        if self._relit is None:
            self._add_relit_views(tuple(relit_views(self._taught, frame.image)))
        last = self._tracker.scene
        scene = prepare_scene(frame.image, frame.time)
        bodies = [moving_body(r, scene) for r in moving] if self._tracker.seeks_new else []
        tracks = self._tracker.step(scene, lambda blob: self._id_for(blob, moving, scene), bodies)
        if not image_is_trusted(observation):
            return []
        before = None if last is None else last.time
        outlined = [(t, self._outline(t, scene)) for t in tracks]
        objects = [(t, object_region(t, o, scene, before)) for t, o in outlined if o is not None]
        shown = {r.id for _, r in objects}
        moving = [r for r in moving if r.id not in shown]
        others = unexplained(moving, [r for _, r in objects], frame.size)
        objects, others = self._with_parts(objects, others, scene)
        regions = sorted([*others, *(r for _, r in objects)], key=lambda r: r.id)
        camera = self._tracker.camera
        return [
            *(
                []
                if camera is None
                else [self._percept(frame, "camera", CameraMotion(camera), 1.0)]
            ),
            *(self._percept(frame, "region", r, r.confidence) for r in regions),
            *(self._hypothesis(frame, t, r) for t, r in objects),
        ]

    def _with_parts(
        self,
        objects: Sequence[tuple[TaughtObjectTrack, Region]],
        others: Sequence[Region],
        scene: Scene,
    ) -> tuple[list[tuple[TaughtObjectTrack, Region]], tuple[Region, ...]]:
        """The objects, each with its severed parts; and the other regions."""
        seen = [(r, t.appearance) for t, r in objects if t.appearance is not None]
        self._parts = update_support(self._parts, seen, others, scene)
        shown = {r.id for _, r in objects}
        owner = {p: t for t, p in joined(self._parts) if t in shown}
        whole = [
            (t, with_parts(r, (p for p in others if owner.get(p.id) == r.id), scene.frame_size))
            for t, r in objects
        ]
        return whole, tuple(r for r in others if r.id not in owner)

    def _add_relit_views(self, views: tuple[tuple[int, TaughtView], ...] | None) -> None:
        """Add views whose colours are adapted to the video's lighting, if it differs; see `relit_views`."""
        self._relit = views
        if views:
            self._tracker = TaughtObjectTracker(
                view_models([*self._taught, *(v for _, v in views)])
            )

    def _view_number(self, track: TaughtObjectTrack) -> int:
        """Number, from 0, of the taught view that an object matches, among those of its name."""
        origins = [*range(len(self._taught)), *(k for k, _ in self._relit or ())]
        mine = [k for k, v in enumerate(self._taught) if v.name == track.name]
        return mine.index(origins[track.view_number])

    def _outline(self, track: TaughtObjectTrack, scene: Scene) -> RegionOutline | None:
        """The visible outline of an object; redrawn only when it has changed."""
        known = self._drawn.get(track.key)
        if track.visible is None:
            return None
        if known is None or known[0] is not track.visible:
            known = track.visible, object_outline(track.visible, scene)
            self._drawn[track.key] = known
        return known[1]

    def _id_for(self, blob: Blob, moving: Sequence[Region], scene: Scene) -> int:
        """The id of a newly detected object: that of the region that moved there, if any."""
        known = {t.id for t in self._tracker.tracks}
        same = [
            r for r in moving if r.id not in known and region_iou(r, blob, scene) > SAME_OBJECT_IOU
        ]
        return min((r.id for r in same), default=None) or self._motion.new_id()

    def _percept(self, frame: Frame, kind: str, value: Any, sure: float) -> Percept:
        return Percept(kind, value, frame.time, self.contract.name, sure)

    def _hypothesis(self, frame: Frame, track: TaughtObjectTrack, region: Region) -> Percept:
        sure = confidence(track)
        number = self._view_number(track)
        hypothesis = Hypothesis(region_id=region.id, name=track.name, view=number, similarity=sure)
        return self._percept(frame, "hypothesis", hypothesis, sure)
