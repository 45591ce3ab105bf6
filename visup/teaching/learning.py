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
from visup.teaching.outline_teaching import TeachingResult, store

VIEWS = 5
"""Default number of further views of each object."""

MIN_AREA = 64
"""Pixels below which a sighting shows too little."""

_CLEAREST_SHARE = 0.5  # of all sightings, the clearest are chosen from
_STEADY_WINDOW = 3  # sightings before and after with which a size is compared
_SIZE_WEIGHT = 2.0  # body lengths that twice the size counts for
_TIME_WEIGHT = 0.4  # body lengths that all the time counts for: light changes
_MIN_DISTANCE = 0.25  # body lengths by which a further sighting differs at least


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
    run: Path, models: Path, things: Mapping[str, int], source: str | None, max_views: int
) -> TeachingResult:
    """As `learn`; what came of it, with sentences."""
    if max_views < 1:
        raise SettingsError(f"{max_views} views were asked for", expected="at least 1")
    recording = Recording.open(run)
    summaries = list(recording.summaries())
    confirmed = _confirmed(recording, things, summaries, str(run))
    sightings_of = sightings(recording, summaries, set(confirmed))
    chosen = {number: spread(clear(sightings_of[number]), max_views) for number in confirmed}
    for number, selected in chosen.items():
        if not selected:
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
    identities = {
        n: name for answers in recording.answers().values() for n, name in answers.items()
    }
    identities = {n: name for n, name in identities.items() if name != UNKNOWN_OBJECT}
    identities |= {number: name for name, number in things.items()}
    counts = Counter(o["id"] for s in summaries for o in s["objects"])
    for number, name in identities.items():
        if number not in counts:
            raise SettingsError(
                f"there is no object {number} in this run, which '{name}' is said to be",
                where=where,
                expected=_objects(summaries),
            )
    if not identities:
        raise SettingsError(
            "no object of this run was identified by the operator",
            where=where,
            expected="answers of the operator, or --thing NAME=OBJECT",
            hint=f"objects of this run: {_objects(summaries)}",
        )
    return identities


def _objects(summaries: Sequence[Mapping[str, Any]]) -> str:
    """The objects of a run that were seen longest, in words."""
    counts = Counter(o["id"] for s in summaries for o in s["objects"] if o["confirmed"])
    names = {o["id"]: o["candidates"] for s in summaries for o in s["objects"]}
    listed = []
    for number, count in counts.most_common(8):
        likeliest = names[number][0][0] if names[number] else UNKNOWN_OBJECT
        listed.append(f"{number} ({likeliest}, {count} frames)")
    return ", ".join(listed) or "none"


def sightings(
    recording: Recording, summaries: Sequence[Mapping[str, Any]], object_ids: set[int]
) -> dict[int, list[Sighting]]:
    """Where some objects were seen, frame by frame: object -> sightings in the order of time."""
    found: dict[int, list[Sighting]] = {number: [] for number in object_ids}
    by_frame = {s["frame_index"]: s["objects"] for s in summaries}
    for observation in recording.observations():
        objects = [o for o in by_frame.get(observation.frame_index, ()) if o["presence"] == "seen"]
        regions: dict[int, Region] = {r.id: r for r in observation.of("region")}
        uses = Counter(o["region"] for o in objects)
        for belief in objects:
            region = regions.get(belief["region"])
            if belief["id"] in object_ids and region is not None and region.area >= MIN_AREA:
                others = [r.bbox for r in regions.values() if r.id != region.id]
                hidden = max((_covered(region.bbox, other) for other in others), default=0.0)
                shared = uses[region.id] > 1
                found[belief["id"]].append(
                    Sighting(observation.frame_index, region, hidden, shared)
                )
    return found


def _covered(box: Sequence[int], other: Sequence[int]) -> float:
    """Share of a box that lies in another one."""
    wide = min(box[0] + box[2], other[0] + other[2]) - max(box[0], other[0])
    high = min(box[1] + box[3], other[1] + other[3]) - max(box[1], other[1])
    return max(0, wide) * max(0, high) / (box[2] * box[3])


def clear(candidates: Sequence[Sighting]) -> list[Sighting]:
    """The clearer half of some sightings, in their order: alone, whole, steady, slow.

    A region that is two objects at once shows neither, and is left out.
    """
    single = [s for s in candidates if not s.shared]
    if not single:
        return []
    areas = np.array([s.region.area for s in single])
    unclarity = [
        _unclarity(s, areas[max(0, k - _STEADY_WINDOW) : k + _STEADY_WINDOW + 1])
        for k, s in enumerate(single)
    ]
    order = sorted(range(len(single)), key=lambda k: (unclarity[k], k))
    clearest = sorted(order[: max(1, round(_CLEAREST_SHARE * len(single)))])
    return [single[k] for k in clearest]


def _unclarity(sighting: Sighting, nearby_areas: NDArray[np.float64]) -> float:
    region = sighting.region
    unsteady = abs(float(np.log(region.area / np.median(nearby_areas))))
    # A body that passes its own length in a second is blurred, and its outline is late.
    speed = float(np.hypot(*region.velocity)) / region.area**0.5
    return float(sighting.hidden + unsteady + 0.3 * min(1.0, speed) + 0.5 * region.cut)


def spread(candidates: Sequence[Sighting], max_count: int) -> list[Sighting]:
    """A few sightings that differ most in place, size, form and time, in their order.

    The first is the one in the middle of all; each further one is as far as can be from those chosen.
    What hardly differs from them is left out: a body that rests shows itself once or twice.
    """
    if not candidates:
        return []
    features = _features(candidates)
    middle = np.median(features, axis=0)
    chosen = [int(np.argmin(np.abs(features - middle).sum(axis=1)))]
    while len(chosen) < min(max_count, len(candidates)):
        distances = np.abs(features[:, None] - features[chosen]).sum(axis=2).min(axis=1)
        if distances.max() <= _MIN_DISTANCE:
            break
        chosen.append(int(np.argmax(distances)))
    return [candidates[k] for k in sorted(chosen)]


def _features(candidates: Sequence[Sighting]) -> NDArray[np.float64]:
    """In which sightings may differ: place in body lengths, size and form in doublings, share of time."""
    areas = np.array([s.region.area for s in candidates])
    places = np.array([s.region.centroid for s in candidates]) / np.sqrt(np.median(areas))
    forms = np.log2([s.region.bbox[2] / s.region.bbox[3] for s in candidates])
    times = np.array([float(s.frame) for s in candidates])
    duration = max(float(np.ptp(times)), 1.0)
    return np.column_stack(
        [places, np.log2(areas) / 2 * _SIZE_WEIGHT, forms, _TIME_WEIGHT * times / duration]
    )


def _views(
    recording: Recording,
    confirmed: Mapping[int, str],
    chosen: Mapping[int, Sequence[Sighting]],
    source: str | None,
) -> list[TaughtView]:
    """Pixels of the chosen sightings, from the run's video."""
    with _video(recording, source) as frames:
        labelled = sorted(
            ((s, confirmed[number]) for number, selected in chosen.items() for s in selected),
            key=lambda pair: (pair[0].frame, pair[1]),
        )
        return list(_cut_views(frames, labelled, recording))


def _cut_views(
    frames: ClipFrames, labelled: Sequence[tuple[Sighting, str]], recording: Recording
) -> Iterator[TaughtView]:
    size = tuple(recording.facts().get("size", ()))
    for sighting, name in labelled:
        picture = frames.at(sighting.frame)
        size_found = picture.shape[1], picture.shape[0]
        if size and size_found != size:
            raise SourceError(
                f"this is not the video of the run: its frames are {size_found[0]} x {size_found[1]}",
                where=frames.name,
                expected=f"{size[0]} x {size[1]}",
            )
        yield taught_view_from_mask(name, picture, sighting.region.full_mask(size_found))


def _video(recording: Recording, source: str | None) -> ClipFrames:
    facts, where = recording.facts(), str(recording.path)
    if facts.get("live") and source is None:
        raise SourceError(
            "this run watched a camera, whose frames are gone",
            where=where,
            hint="if it was also recorded, give the recording: --source FILE",
        )
    path = source or recorded_settings(facts, where).source
    try:
        return ClipFrames(path)
    except SourceError as fault:
        raise SourceError(
            f"the video of this run cannot be opened: {fault.what}",
            where=path,
            hint="if it has moved, give its path: --source FILE",
        ) from fault
