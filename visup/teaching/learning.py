"""`visup.learn`: add views of objects whose identity was confirmed in a recorded run.

The operator has identified objects; the journal records where each was in every frame, and the source shows
its appearance. A few clear and dissimilar frames are stored.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError, SourceError
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.agent.model.records import Region
from visup.agent.storage.journal_reader import Recording
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.taught_view import TaughtView, taught_view_from_mask
from visup.runs.resume import recorded_settings
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.lesson import Lesson, store

VIEWS = 5
"""Default number of further views of each object."""

LEAST_AREA = 64
"""Pixels below which a sighting shows too little."""

_CLEAR_SHARE = 0.5  # of all sightings, the clearest are chosen from
_STEADY = 3  # sightings before and after with which a size is compared
_SIZE = 2.0  # body lengths that twice the size counts for
_TIME = 0.4  # body lengths that all the time counts for: light changes
_ALIKE = 0.25  # body lengths by which a further sighting differs at least


@dataclass(frozen=True, slots=True)
class Sighting:
    """A confirmed object in one frame.

    Attributes:
        frame: Number of the frame.
        region: Where it is seen.
        hidden: Share of its box that the boxes of others cover.
        shared: Whether another object is believed to be the same region.
    """

    frame: int
    region: Region
    hidden: float
    shared: bool


def learn(
    run: str | os.PathLike[str],
    *,
    models: str | os.PathLike[str] | ModelDatabase,
    things: Mapping[str, int] | None = None,
    source: str | None = None,
    views: int = VIEWS,
) -> ModelDatabase:
    """Add views of objects whose identity was confirmed in a recorded run.

    Example:
        ```python
        visup.learn("runs/monday", models="cell.models", things={"gripper": 4})
        ```

    Args:
        run: A run folder, or the journal in it.
        models: The model database; one that does not exist yet is created.
        things: Name -> object id, in addition to the operator's answers.
        source: The video of the run, if it has moved.
        views: Most views to add for each name.

    Returns:
        The updated database.

    Raises:
        VisupError: There is no such run, its video is gone, or no object was identified; then nothing is
            stored.
    """
    path = models.path if isinstance(models, ModelDatabase) else Path(models)
    return learn_from(Path(run), path, things or {}, source, views).database


def learn_from(
    run: Path, models: Path, things: Mapping[str, int], source: str | None, most: int
) -> Lesson:
    """As `learn`; what came of it, with sentences."""
    if most < 1:
        raise SettingsError(f"{most} views were asked for", expected="at least 1")
    recording = Recording.open(run)
    summaries = list(recording.summaries())
    confirmed = _confirmed(recording, things, summaries, str(run))
    seen = sightings(recording, summaries, set(confirmed))
    chosen = {number: spread(clear(seen[number]), most) for number in confirmed}
    for number, found in chosen.items():
        if not found:
            raise SettingsError(
                f"object {number} of this run, '{confirmed[number]}', is never seen clearly",
                where=str(run),
            )
    return store(models, _views(recording, confirmed, chosen, source))


def _confirmed(
    recording: Recording,
    things: Mapping[str, int],
    summaries: Sequence[Mapping[str, Any]],
    where: str,
) -> dict[int, str]:
    """Object -> name, as the operator answered and as is said now."""
    told = {n: name for said in recording.answers().values() for n, name in said.items()}
    told = {n: name for n, name in told.items() if name != UNKNOWN_OBJECT}
    told |= {number: name for name, number in things.items()}
    counts = Counter(o["id"] for s in summaries for o in s["objects"])
    for number, name in told.items():
        if number not in counts:
            raise SettingsError(
                f"there is no object {number} in this run, which '{name}' is said to be",
                where=where,
                expected=_objects(summaries),
            )
    if not told:
        raise SettingsError(
            "no object of this run was identified by the operator",
            where=where,
            expected="answers of the operator, or --thing NAME=OBJECT",
            hint=f"objects of this run: {_objects(summaries)}",
        )
    return told


def _objects(summaries: Sequence[Mapping[str, Any]]) -> str:
    """The objects of a run that were seen longest, in words."""
    counts = Counter(o["id"] for s in summaries for o in s["objects"] if o["confirmed"])
    names = {o["id"]: o["candidates"] for s in summaries for o in s["objects"]}
    said = []
    for number, count in counts.most_common(8):
        likeliest = names[number][0][0] if names[number] else UNKNOWN_OBJECT
        said.append(f"{number} ({likeliest}, {count} frames)")
    return ", ".join(said) or "none"


def sightings(
    recording: Recording, summaries: Sequence[Mapping[str, Any]], wanted: set[int]
) -> dict[int, list[Sighting]]:
    """Where some objects were seen, frame by frame: object -> sightings in the order of time."""
    found: dict[int, list[Sighting]] = {number: [] for number in wanted}
    by_frame = {s["frame_index"]: s["objects"] for s in summaries}
    for seen in recording.observations():
        objects = [o for o in by_frame.get(seen.frame_index, ()) if o["presence"] == "seen"]
        regions: dict[int, Region] = {r.id: r for r in seen.of("region")}
        uses = Counter(o["region"] for o in objects)
        for known in objects:
            region = regions.get(known["region"])
            if known["id"] in wanted and region is not None and region.area >= LEAST_AREA:
                others = [r.bbox for r in regions.values() if r.id != region.id]
                hidden = max((_covered(region.bbox, other) for other in others), default=0.0)
                shared = uses[region.id] > 1
                found[known["id"]].append(Sighting(seen.frame_index, region, hidden, shared))
    return found


def _covered(box: Sequence[int], other: Sequence[int]) -> float:
    """Share of a box that lies in another one."""
    wide = min(box[0] + box[2], other[0] + other[2]) - max(box[0], other[0])
    high = min(box[1] + box[3], other[1] + other[3]) - max(box[1], other[1])
    return max(0, wide) * max(0, high) / (box[2] * box[3])


def clear(seen: Sequence[Sighting]) -> list[Sighting]:
    """The clearer half of some sightings, in their order: alone, whole, steady, slow.

    A region that is two objects at once shows neither, and is left out.
    """
    single = [s for s in seen if not s.shared]
    if not single:
        return []
    areas = np.array([s.region.area for s in single])
    doubt = [_doubt(s, areas[max(0, k - _STEADY) : k + _STEADY + 1]) for k, s in enumerate(single)]
    order = sorted(range(len(single)), key=lambda k: (doubt[k], k))
    kept = sorted(order[: max(1, round(_CLEAR_SHARE * len(single)))])
    return [single[k] for k in kept]


def _doubt(sighting: Sighting, around: NDArray[np.float64]) -> float:
    region = sighting.region
    unsteady = abs(float(np.log(region.area / np.median(around))))
    # A body that passes its own length in a second is blurred, and its outline is late.
    speed = float(np.hypot(*region.velocity)) / region.area**0.5
    return float(sighting.hidden + unsteady + 0.3 * min(1.0, speed) + 0.5 * region.cut)


def spread(seen: Sequence[Sighting], most: int) -> list[Sighting]:
    """A few sightings that differ most in place, size, form and time, in their order.

    The first is the one in the middle of all; each further one is as far as can be from those chosen.
    What hardly differs from them is left out: a body that rests shows itself once or twice.
    """
    if not seen:
        return []
    traits = _traits(seen)
    middle = np.median(traits, axis=0)
    chosen = [int(np.argmin(np.abs(traits - middle).sum(axis=1)))]
    while len(chosen) < min(most, len(seen)):
        gaps = np.abs(traits[:, None] - traits[chosen]).sum(axis=2).min(axis=1)
        if gaps.max() <= _ALIKE:
            break
        chosen.append(int(np.argmax(gaps)))
    return [seen[k] for k in sorted(chosen)]


def _traits(seen: Sequence[Sighting]) -> NDArray[np.float64]:
    """In which sightings may differ: place in body lengths, size and form in doublings, share of time."""
    areas = np.array([s.region.area for s in seen])
    places = np.array([s.region.centroid for s in seen]) / np.sqrt(np.median(areas))
    forms = np.log2([s.region.bbox[2] / s.region.bbox[3] for s in seen])
    times = np.array([float(s.frame) for s in seen])
    lasted = max(float(np.ptp(times)), 1.0)
    return np.column_stack([places, np.log2(areas) / 2 * _SIZE, forms, _TIME * times / lasted])


def _views(
    recording: Recording,
    confirmed: Mapping[int, str],
    chosen: Mapping[int, Sequence[Sighting]],
    source: str | None,
) -> list[TaughtView]:
    """Pixels of the chosen sightings, from the run's video."""
    with _video(recording, source) as frames:
        shown = sorted(
            ((s, confirmed[number]) for number, found in chosen.items() for s in found),
            key=lambda pair: (pair[0].frame, pair[1]),
        )
        return list(_shown(frames, shown, recording))


def _shown(
    frames: ClipFrames, shown: Sequence[tuple[Sighting, str]], recording: Recording
) -> Iterator[TaughtView]:
    size = tuple(recording.facts().get("size", ()))
    for sighting, name in shown:
        picture = frames.at(sighting.frame)
        found = picture.shape[1], picture.shape[0]
        if size and found != size:
            raise SourceError(
                f"this is not the video of the run: its frames are {found[0]} x {found[1]}",
                where=frames.name,
                expected=f"{size[0]} x {size[1]}",
            )
        yield taught_view_from_mask(name, picture, sighting.region.full_mask(found))


def _video(recording: Recording, source: str | None) -> ClipFrames:
    facts, where = recording.facts(), str(recording.path)
    if facts.get("live") and source is None:
        raise SourceError(
            "this run watched a camera, whose frames are gone",
            where=where,
            hint="if it was also recorded, give the recording: --source FILE",
        )
    named = source or recorded_settings(facts, where).source
    try:
        return ClipFrames(named)
    except SourceError as fault:
        raise SourceError(
            f"the video of this run cannot be opened: {fault.what}",
            where=named,
            hint="if it has moved, give its path: --source FILE",
        ) from fault
