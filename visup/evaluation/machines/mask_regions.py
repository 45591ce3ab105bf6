"""Ideal perception: regions from the masks of a world, named by their roles.

It separates the errors of reasoning from those of perception. Only visible parts in the mask are regions;
motion is computed from the masks, too. Regions and names are in one report, as from a detector of taught
objects: such a region belongs to a single object, whatever it touches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Directive, Frame, Health, HealthStatus, Hypothesis, Observation, Percept
from visup.agent.contract.behaviour import Behaviour, Contract
from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.mask_camera import SceneCamera
from visup.evaluation.missions.files import read_json
from visup.evaluation.simulation.truth_masks import LAG_S, TrueMask, moved_since, true_mask
from visup.percepts.opencv_names import opencv_name
from visup.testing import region_of

MIN_VISIBLE_PX = 30
"""Least visible area of an object, pixels."""

VELOCITY_SIGMA = 1.0
SIMILARITY = 0.95


@dataclass(slots=True)
class MaskRegions:
    """A behaviour that reports the masks of a world as regions with roles.

    Attributes:
        mask: Returns the (H, W) uint8 mask of a frame number.
        labels: Role -> value in the masks.
        fps: Frames per second.
    """

    mask: Callable[[int], NDArray[np.uint8]]
    labels: Mapping[str, int]
    fps: float
    contract: Contract = field(
        default=Contract("masks", gives=("region", "hypothesis", "health")), init=False
    )
    _history: list[dict[str, TrueMask]] = field(default_factory=list, init=False)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report one frame; see `Behaviour`."""
        yield Percept("health", Health(HealthStatus.OK), frame.time, "masks")
        label_image = self.mask(frame.index)
        current = {
            n: m for n, v in self.labels.items() if (m := true_mask(label_image == v)) is not None
        }
        lag = max(1, round(LAG_S * self.fps))
        self._history = [*self._history[-lag:], current]
        span = (len(self._history) - 1) / self.fps
        with_velocity = (
            moved_since(self._history[0], current, span, frame.size) if span else current
        )
        for number, (name, value) in enumerate(sorted(self.labels.items()), start=1):
            mask = label_image == value
            if np.count_nonzero(mask) < MIN_VISIBLE_PX:
                continue
            velocity = with_velocity[name].velocity
            region = replace(
                region_of(mask, number, velocity or (0.0, 0.0)),
                velocity_sigma=0.0 if velocity is None else VELOCITY_SIGMA,
            )
            yield Percept("region", region, frame.time, "masks", region.confidence)
            named = Hypothesis(number, name, 0, SIMILARITY)
            yield Percept("hypothesis", named, frame.time, "masks", SIMILARITY)


def has_masks(folder: Path) -> bool:
    """Whether a clip has masks."""
    return (folder / "masks").is_dir()


def mask_behaviours(folder: Path) -> list[Behaviour]:
    """Ideal perception of a world: the region of each role by its name, and the camera's motion.

    Raises:
        SettingsError: The truth cannot be read.
    """
    truth = read_json(folder / "truth.json")
    roles: Mapping[str, str] = truth.get("roles") or {n: n for n in truth["labels"]}
    labels = {role: int(truth["labels"][name]) for role, name in roles.items()}
    mask = partial(read_mask, folder)
    return [SceneCamera(mask), *role_behaviours(mask, labels, float(truth["fps"]))]


def role_behaviours(
    mask: Callable[[int], NDArray[np.uint8]], labels: Mapping[str, int], fps: float
) -> list[Behaviour]:
    """Ideal perception from masks; arguments as for `MaskRegions`."""
    return [MaskRegions(mask, labels, fps)]


def read_mask(folder: Path, index: int) -> NDArray[np.uint8]:
    """(H, W) labels of a frame of a clip.

    Raises:
        SettingsError: There is no such mask, or it cannot be read.
    """
    path = folder / "masks" / f"{index:05d}.png"
    label_image = cv2.imread(opencv_name(path), cv2.IMREAD_GRAYSCALE)
    if label_image is None:
        raise SettingsError("a mask is missing or cannot be read", where=str(path))
    return np.asarray(label_image, dtype=np.uint8)
