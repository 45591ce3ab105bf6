"""The records of visup, from a frame to a step: frozen, typed, passive.

Frames of reference: image coordinates are pixels with x to the right and y down, the origin at the
centre of the top left pixel; boxes are half open (x, y, width, height); times are seconds since the
start of the source; velocities are pixels per second. Arrays in records are never written to.

Read next: `events.py`, `mind.py` (what is believed), then `cycle/agent.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from visup.agent.model.display import enable_display

if TYPE_CHECKING:
    # Types only, so that importing records stays fast.
    import numpy as np
    from numpy.typing import NDArray

EMPTY: Mapping[str, Any] = MappingProxyType({})


def empty() -> Mapping[str, Any]:
    """The empty mapping, as a default factory for dataclasses."""
    return EMPTY


class Truth(StrEnum):
    """Three-valued truth: what was not observed is unknown, never false."""

    TRUE = "true"
    FALSE = "false"
    UNKNOWN = "unknown"


class HealthStatus(StrEnum):
    """State of the camera's image; with anything but OK, motion cannot be trusted."""

    OK = "ok"
    DARK = "dark"
    SATURATED = "saturated"
    FROZEN = "frozen"
    BLOCKED = "blocked"
    NOISY = "noisy"
    SCRAMBLED = "scrambled"
    DROPPED = "dropped"


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """An image with its time.

    Attributes:
        index: Number of the frame in its source, from 0.
        time: Seconds since the start of the source.
        image: (H, W, 3) uint8, BGR.
    """

    index: int
    time: float
    image: NDArray[np.uint8]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self.image.shape[1], self.image.shape[0]


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """A part of the image that moves coherently.

    Attributes:
        id: Stable number of the region within one run, from 1.
        bbox: (x, y, width, height), pixels, half open; encloses the mask exactly.
        mask: (height, width) bool, cropped to `bbox`.
        contour: (N, 2) float32, outer boundary (x, y) in the image.
        centroid: (x, y) of the mask, pixels.
        area: Pixels in the mask.
        velocity: (vx, vy) pixels per second.
        velocity_sigma: Standard deviation of each velocity component, pixels per second.
        motion: (2, 3) float, affine motion of the region between the last frame and this one.
        cut: Whether the image border cuts the region.
        confidence: Confidence of the segmenter that this is a moving object, 0 to 1.
        visible_since: Time since which it has been in view, moving or not, as far as can be traced
            back; None if it was not traced.
    """

    id: int
    bbox: tuple[int, int, int, int]
    mask: NDArray[np.bool_]
    contour: NDArray[np.float32]
    centroid: tuple[float, float]
    area: float
    velocity: tuple[float, float] = (0.0, 0.0)
    velocity_sigma: float = 0.0
    motion: NDArray[np.float64] | None = None
    cut: bool = False
    confidence: float = 1.0
    visible_since: float | None = None

    def full_mask(self, size: tuple[int, int]) -> NDArray[np.bool_]:
        """The mask in a whole image.

        Args:
            size: (width, height) of the image, pixels.

        Returns:
            (height, width) bool; what lies outside the image (an object is believed to have moved
            there) is left out.
        """
        import numpy as np

        out = np.zeros((size[1], size[0]), dtype=bool)
        x, y, _, _ = self.bbox
        left, top = max(0, -x), max(0, -y)
        inside = self.mask[top : max(top, size[1] - y), left : max(left, size[0] - x)]
        rows, columns = inside.shape
        out[y + top : y + top + rows, x + left : x + left + columns] = inside
        return out


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """'Region 2 looks like view 45 of `spartan`, similarity 0.87' (paper, section 4, figure 4).

    Attributes:
        region_id: The region that was matched.
        name: Name of the model.
        view: Number of the view within the model.
        similarity: 0 to 1.
        rotation: In-plane rotation from view to region, radians, or None.
        scale: Region pixels per unit of the model (metres where the model has metres), or None.
        direction: Unit vector from the object to the viewer in the model's frame, or None.
        fitted: Whether direction and rotation were fitted to the image; otherwise they are those of a stored
            view, about ten degrees off.
        of_kind: Whether the name is a class label, as from a detector, that several objects can have at once.
    """

    region_id: int
    name: str
    view: int
    similarity: float
    rotation: float | None = None
    scale: float | None = None
    direction: tuple[float, float, float] | None = None
    fitted: bool = False
    of_kind: bool = False


@dataclass(frozen=True, slots=True)
class Depth:
    """Relative depth of a region under one identity, from its size (paper, section 7.4).

    Attributes:
        region_id: The region.
        name: The model whose size was compared.
        depth: Distance along the line of sight in model units (metres for metric models).
        sigma: Standard deviation of `depth`.
    """

    region_id: int
    name: str
    depth: float
    sigma: float


@dataclass(frozen=True, slots=True, eq=False)
class CameraMotion:
    """Apparent motion of the static scene caused by motion of the camera.

    Attributes:
        motion: (2, 3) float, affine motion of the picture between the last frame and this one, pixels
            to pixels; the identity for a static camera.
    """

    motion: NDArray[np.float64]

    def displacement(self, at: tuple[float, float]) -> tuple[float, float]:
        """(dx, dy) by which a static point at (x, y) of this frame moved in the image, pixels."""
        (a, b, c), (d, e, f) = self.motion.tolist()
        x, y, turn = at[0] - c, at[1] - f, a * e - b * d
        return at[0] - (e * x - b * y) / turn, at[1] - (a * y - d * x) / turn

    @property
    def magnification(self) -> float:
        """Factor by which areas in the image have grown since the last frame; 1 without zoom."""
        (a, b, _), (d, e, _) = self.motion.tolist()
        return float(a * e - b * d)


@dataclass(frozen=True, slots=True)
class Health:
    """State of the camera image.

    Attributes:
        status: The state.
        detail: One sentence for the user, empty when OK.
    """

    status: HealthStatus
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Percept:
    """A report of a behaviour about a frame.

    Attributes:
        kind: 'region', 'hypothesis', 'depth', 'camera', 'health', or a plug-in's own kind.
        value: `Region`, `Hypothesis`, `Depth`, `CameraMotion`, `Health`, or a plug-in's own value.
        time: Seconds, the frame's time.
        source: Name of the behaviour.
        confidence: 0 to 1.
    """

    kind: str
    value: Any
    time: float
    source: str
    confidence: float = 1.0


class ReportState(StrEnum):
    """Whether and how a behaviour ran in one step."""

    RAN = "ran"
    RESTED = "rested"
    BLIND = "blind"
    FAILED = "failed"
    LATE = "late"
    SUSPENDED = "suspended"


FAULT_STATES = frozenset({ReportState.FAILED, ReportState.LATE, ReportState.SUSPENDED})
"""States of a behaviour that is itself at fault; a blind one only lacks its inputs."""


@dataclass(frozen=True, slots=True)
class Report:
    """What one behaviour did in one step.

    Attributes:
        behaviour: Its name.
        state: Ran; rested (not due); blind (an input is unknown); failed; late (it
            did not answer in time); or suspended (paused after a failure).
        gives: The kinds of percept that it can report.
        percepts: Its percepts; empty unless it ran.
        error: What went wrong, unless it ran.
        elapsed_ms: Wall time; for information, never used for decisions.
    """

    behaviour: str
    state: ReportState
    gives: tuple[str, ...] = ()
    percepts: tuple[Percept, ...] = ()
    error: str = ""
    elapsed_ms: float = field(default=0.0, compare=False)


@dataclass(frozen=True, slots=True)
class Observation:
    """All percepts of one frame: what reasoners get instead of the frame itself.

    Attributes:
        frame_index: Number of the frame.
        time: Seconds.
        frame_size: (width, height) pixels.
        reports: One for each behaviour.
        past: Past frames, oldest first, with their observations: only for behaviours whose contract
            requests them.
    """

    frame_index: int
    time: float
    frame_size: tuple[int, int]
    reports: tuple[Report, ...] = ()
    past: tuple[PastFrame, ...] = field(default=(), repr=False, compare=False)

    def of(self, kind: str) -> tuple[Any, ...]:
        """Values of all percepts of one kind, in order."""
        return tuple(p.value for r in self.reports for p in r.percepts if p.kind == kind)

    def observed(self, kind: str) -> bool:
        """Whether this kind was observable, so that an absence of percepts means an absence of objects.

        Some behaviour that reports it ran, and none that should have failed to.
        """
        ran = any(r.state is ReportState.RAN and kind in r.gives for r in self.reports)
        return ran and kind not in self.unknown

    @property
    def unknown(self) -> frozenset[str]:
        """Kinds that some behaviour should have reported but could not.

        Nothing follows from their absence.
        """
        unable = (
            r for r in self.reports if r.state in FAULT_STATES or r.state is ReportState.BLIND
        )
        return frozenset(kind for r in unable for kind in r.gives)


@dataclass(frozen=True, slots=True, eq=False)
class PastFrame:
    """An earlier frame, with its observation.

    Attributes:
        frame: The frame.
        observation: Its observation.
    """

    frame: Frame
    observation: Observation


enable_display(CameraMotion, Depth, Frame, Health, Hypothesis, Observation, Percept, Region, Report)
