"""`visup eval robustness`: damaged database files and odd masks, and what comes of them.

A damaged file is refused with an error for the user, or answers as the sound file does; an odd mask is
answered, is refused, or shows nothing. Whatever else happens is a failure, and so is more than a second.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tests.oracles.shape.corrupt import (
    CORRUPTIONS,
    HARMLESS,
    LARGE,
    MASKS,
    corrupt_file,
    odd_mask,
)
from visup.agent.model.errors import VisupError
from visup.evaluation.figures import Progress, silent
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.index.view_records import NewView
from visup.percepts.shape.matching.shape_similarity import shape_of
from visup.percepts.shape.silhouette.silhouette import normalise

FILES = 2000
ODD_MASKS = 2000

MAX_S = 1.0
"""Seconds that a trial may take."""

EVERY_LARGE = 40
"""One mask in so many is of the largest size."""

_VIEWS = 12


@dataclass(frozen=True, slots=True)
class CorruptionOutcome:
    """What came of a trial.

    Attributes:
        kind: A key of `CORRUPTIONS` or `MASKS`.
        number: Within the campaign.
        what: 'refused', 'answered', 'nothing', or what went wrong.
        seconds: Time of the processor that it took.
    """

    kind: str
    number: int
    what: str
    seconds: float

    @property
    def failed(self) -> bool:
        """Whether it is neither an answer, nor a refusal, nor in time."""
        return self.what not in ("refused", "answered", "nothing") or self.seconds > MAX_S


def evaluate_robustness(
    *,
    files: int = FILES,
    masks: int = ODD_MASKS,
    seed: int = 0,
    largest: int = LARGE,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run both campaigns on a database made here.

    Args:
        files: How many damaged files; they go round the kinds.
        masks: How many odd masks; they go round the kinds.
        seed: Of both campaigns.
        largest: Side of the largest masks, pixels.
        progress: Shows what is being done.

    Returns:
        `items` by kind and `total`, with the keys `trials`, `refused`, `answered`, `nothing`,
        `failed` (counts) and `worst_s`; `failures` lists what failed: kind, number, what, seconds.
    """
    outcomes: list[CorruptionOutcome] = []
    with tempfile.TemporaryDirectory() as scratch:
        database = sound_database(Path(scratch) / "sound.db", seed)
        for number in range(files):
            if number % 50 == 0:
                progress(f"damaged file {number} of {files}")
            outcomes.append(try_file(database, Path(scratch) / "damaged.db", number, seed))
        for number in range(masks):
            if number % 50 == 0:
                progress(f"odd mask {number} of {masks}")
            outcomes.append(try_mask(database, number, seed, largest))
    kinds = dict.fromkeys([*(o.kind for o in outcomes)])
    return {
        "items": {k: _counted([o for o in outcomes if o.kind == k]) for k in kinds},
        "total": _counted(outcomes),
        "failures": [
            {"kind": o.kind, "number": o.number, "what": o.what, "seconds": o.seconds}
            for o in outcomes
            if o.failed
        ],
    }


def sound_database(path: Path, seed: int) -> ModelDatabase:
    """A small database of drawn shapes, some of them cut."""
    rng = np.random.default_rng([seed, 1])
    views = []
    for number in range(_VIEWS):
        silhouette = normalise(_drawn(rng), cut=number % 4 == 3)
        if silhouette is not None:
            also = ((0.0, 0.0, -1.0),) if number % 2 else ()
            shape = shape_of(silhouette)
            views.append(NewView(f"model {number % 5}", (0.0, 0.0, 1.0), 1.0, shape, also))
    return ModelDatabase.create(path, views)


def _drawn(rng: np.random.Generator) -> NDArray[np.bool_]:
    """A body with limbs."""
    canvas = np.zeros((240, 240), np.uint8)
    half = (int(rng.integers(20, 60)), int(rng.integers(15, 40)))
    cv2.ellipse(canvas, (120, 120), half, float(rng.uniform(0, 180)), 0, 360, 1, -1)
    for angle in rng.uniform(0, 2 * np.pi, int(rng.integers(1, 6))):
        tip = (round(120 + 95 * np.cos(angle)), round(120 + 95 * np.sin(angle)))
        cv2.line(canvas, (120, 120), tip, 1, int(rng.integers(8, 22)))
    return canvas > 0


def try_file(sound: ModelDatabase, path: Path, number: int, seed: int) -> CorruptionOutcome:
    """Damage a file and use it: open it, read every shape, ask it for a shape that it holds."""
    kinds = tuple(CORRUPTIONS)
    kind = kinds[number % len(kinds)]
    corrupt_file(path, sound.path.read_bytes(), kind, np.random.default_rng([seed, 2, number]))
    asked = sound.shapes[number % len(sound.shapes)]
    begin = time.process_time()
    try:
        database = ModelDatabase.open(path)
        shapes = list(database.shapes)
        found = database.query(asked).matches
        what = "answered" if found else "nothing"
        as_before = (len(shapes), found) == (len(sound.shapes), sound.query(asked).matches)
        if kind in HARMLESS and not as_before:
            what = "answers otherwise than the sound file"
    except VisupError:
        what = "refused"
    except Exception as fault:  # anything else is what the campaign looks for
        what = f"{type(fault).__name__}: {fault}"
    return CorruptionOutcome(kind, number, what, time.process_time() - begin)


def try_mask(
    database: ModelDatabase, number: int, seed: int, largest: int = LARGE
) -> CorruptionOutcome:
    """Ask for a mask that no camera gives."""
    rng = np.random.default_rng([seed, 3, number])
    kinds = tuple(MASKS)
    kind = kinds[number % len(kinds)]
    # A stride that shares no factor with the number of kinds, so that each has its large ones.
    size = (largest, largest) if number % (EVERY_LARGE + 1) == EVERY_LARGE else _size(rng)
    mask = odd_mask(kind, size, rng)
    begin = time.process_time()
    try:
        found = database.query(mask, cut=bool(rng.random() < 0.3))  # type: ignore[arg-type]
        what = "answered" if found.matches else "nothing"
    except VisupError:
        what = "refused"
    except Exception as fault:  # anything else is what the campaign looks for
        what = f"{type(fault).__name__}: {fault}"
    return CorruptionOutcome(kind, number, what, time.process_time() - begin)


def _size(rng: np.random.Generator) -> tuple[int, int]:
    """Sides from 1 to some hundred pixels, small ones as often as large ones."""
    height, width = np.exp(rng.uniform(0, np.log(700), 2)).astype(int)
    return max(1, int(height)), max(1, int(width))


def _counted(outcomes: list[CorruptionOutcome]) -> dict[str, Any]:
    counts = {w: sum(o.what == w for o in outcomes) for w in ("refused", "answered", "nothing")}
    failed = sum(o.failed for o in outcomes)
    worst = max((o.seconds for o in outcomes), default=0.0)
    return {"trials": len(outcomes), **counts, "failed": failed, "worst_s": worst}
