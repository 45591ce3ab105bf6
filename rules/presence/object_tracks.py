"""Memory of presence reasoning for each object: last whole position, motion, visible share.

First-order spatial knowledge is where an object was, second-order how it moved (paper, section 5); both help
to distinguish an object that left from one that is hidden.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp, hypot, sqrt
from types import MappingProxyType

from visup.agent import CameraMotion, Mind, Region
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.geometry.regions import Box, box_intersection, expanded, shared_pixels, shifted

EXIT_HORIZON_S = 6.0
"""An object that is leaving is out of view within this time, seconds."""

CAME_SHARE = 0.25
"""Least approach of an object to another one within a second for it to have come there, as a share of the
square root of its area."""

MIN_SIGHTINGS = 3
"""Fewest sightings from which an approach is measured."""

MIN_ZOOM = 0.001
"""Least magnification of a frame that counts as zoom: errors of the estimate must not add up."""

TimedCentroid = tuple[float, float, float]
"""(time, x, y) of a centroid: seconds, pixels."""


@dataclass(frozen=True, eq=False)
class ObjectTrack:
    """The memory of one object's sightings.

    Attributes:
        region: Its region as last seen.
        last_seen: Time of the last sighting, seconds.
        coherent_since: Time since when sightings have followed each other without a jump, seconds.
        coherent_box: Its box at that time.
        sightings: Number of sightings since then.
        centroids: Centroids of the last second in which it was unobstructed; at most 16.
        whole_box: Its box when last seen whole.
        whole_at: Time when last seen whole, seconds.
        velocity: (vx, vy) when last unobstructed, pixels per second.
        reference_area: Area of the whole object, pixels.
        visible_share: Visible share of the reference area, 0 to 1.
        partial_since: Time since when only a small part is visible, seconds, or None.
        clear_since: Time since when most of it is visible again, seconds, or None.
        merged_with: Id of the object whose region contains it, or None.
        merged_since: Time since when that is so, seconds.
        parted_at: Time when it last got its own region again, seconds, or None.
        changed_at: Time when it got another region, whose shape cannot be compared with that of the older
            one, seconds.
        lost: Whether it is hidden without an explanation.
        first_box: Its box when first seen.
        vanished_into: Id of the object that it approached and that has hidden it since, or None.
    """

    region: Region
    last_seen: float
    coherent_since: float
    coherent_box: Box = (0, 0, 0, 0)
    sightings: int = 1
    centroids: tuple[TimedCentroid, ...] = ()
    whole_box: Box = (0, 0, 0, 0)
    whole_at: float = 0.0
    velocity: tuple[float, float] = (0.0, 0.0)
    reference_area: float = 0.0
    visible_share: float = 1.0
    partial_since: float | None = None
    clear_since: float | None = None
    merged_with: int | None = None
    merged_since: float = 0.0
    parted_at: float | None = None
    changed_at: float = -1.0
    lost: bool = False
    first_box: Box = (0, 0, 0, 0)
    vanished_into: int | None = None


@dataclass(frozen=True, slots=True)
class PresenceMemory:
    """All tracks.

    Attributes:
        start: Time of the first observation of regions, seconds; None before it.
        tracks: Object id -> its track.
    """

    start: float | None = None
    tracks: Mapping[int, ObjectTrack] = field(default_factory=lambda: MappingProxyType({}))


TRACKS = MemoryKey("rules.presence", PresenceMemory())


def presence_memory(mind: Mind) -> PresenceMemory:
    """The tracks in the mind's memory."""
    return mind.recall(TRACKS)


def merged_pairs(mind: Mind) -> tuple[tuple[int, int], ...]:
    """Pairs of objects that share one region now."""
    found = [
        (i, t.merged_with)
        for i, t in presence_memory(mind).tracks.items()
        if t.merged_with is not None
    ]
    return tuple(sorted(found)) if found else ()


def visible_share(mind: Mind, object_id: int) -> float:
    """Visible share of an object, 0 to 1; 1 while unknown, 0 while it is in a merged region."""
    of = presence_memory(mind).tracks
    track = of.get(object_id)
    if track is None:
        return 1.0
    merged = track.merged_with is not None or any(t.merged_with == object_id for t in of.values())
    return 0.0 if merged else track.visible_share


def new_track(region: Region, now: float) -> ObjectTrack:
    """The track of a new object."""
    centroid = (now, *region.centroid)
    return ObjectTrack(
        region,
        now,
        now,
        region.bbox,
        centroids=(centroid,),
        whole_box=region.bbox,
        whole_at=now,
        reference_area=region.area,
        changed_at=now,
        first_box=region.bbox,
    )


def update_track(
    track: ObjectTrack,
    region: Region,
    now: float,
    crowded: bool,
    allowed_gap_s: float,
    *,
    recognised: bool = False,
) -> ObjectTrack:
    """Update a track with a sighting.

    Args:
        track: The track before.
        region: The object's region now.
        now: Time of the sighting, seconds.
        crowded: Whether another region touches it, so that a part of it may be hidden.
        allowed_gap_s: A longer gap between sightings breaks coherence.
        recognised: Whether it was recognised by appearance: its motion is then known, whatever touches it.

    Returns:
        The updated track. The reference area follows an unobstructed object, decays slowly for one cut by
        the border, and is frozen for one that others may hide.
    """
    dt = now - track.last_seen
    smooth = dt <= allowed_gap_s and _coherent(track.region, region)
    reference = _reference_area(track, region, dt, crowded)
    visible = min(1.0, region.area / max(reference, 1.0))
    clear = (recognised or not crowded) and visible > 0.7
    centroids = (
        _recent_centroids(track.centroids, (now, *region.centroid)) if clear else track.centroids
    )
    return replace(
        track,
        region=region,
        last_seen=now,
        coherent_since=track.coherent_since if smooth else now,
        coherent_box=track.coherent_box if smooth else region.bbox,
        sightings=track.sightings + 1 if smooth else 1,
        centroids=centroids,
        whole_box=region.bbox if clear else track.whole_box,
        whole_at=now if clear else track.whole_at,
        velocity=_velocity(track, region, centroids, dt) if clear else track.velocity,
        reference_area=reference,
        visible_share=visible,
    )


def magnified(
    tracks: Mapping[int, ObjectTrack], camera: CameraMotion | None
) -> dict[int, ObjectTrack]:
    """The tracks with reference areas that follow the zoom of the camera.

    Without it, objects of which others may hide a part would seem to be hidden as the camera zooms out.
    """
    by = 1.0 if camera is None else camera.magnification
    if abs(by - 1.0) < MIN_ZOOM:
        return dict(tracks)
    return {i: replace(t, reference_area=t.reference_area * by) for i, t in tracks.items()}


def predicted_box(track: ObjectTrack, now: float) -> Box:
    """Predicted box of the whole object, extrapolated at constant velocity for at most 3 s."""
    ahead = min(now - track.whole_at, 3.0)
    return shifted(track.whole_box, track.velocity[0] * ahead, track.velocity[1] * ahead)


def predicted_share_outside(track: ObjectTrack, now: float, frame_size: tuple[int, int]) -> float:
    """Predicted share of the object's last box outside the image by now, 0 to 1."""
    vx, vy = track.velocity
    ahead = now - track.last_seen
    box = shifted(track.region.bbox, vx * ahead, vy * ahead)
    inside = box_intersection(box, (0, 0, *frame_size))
    return 1.0 - inside / max(1, box[2] * box[3])


def heading_out(track: ObjectTrack, frame_size: tuple[int, int], margin: int = 3) -> bool:
    """Whether the object was at an edge of the image, moving over it, and may soon be out of view.

    An object that would need longer than `EXIT_HORIZON_S` at its speed, such as an arm that reaches far
    into the image and whose measured velocity is noise, is not considered leaving.
    """
    x, y, w, h = track.region.bbox
    vx, vy = track.velocity
    width, height = frame_size
    # For each edge: distance of the box, speed towards it, and distance to be entirely out.
    edges = (
        (x, -vx, x + w),
        (y, -vy, y + h),
        (width - x - w, vx, width - x),
        (height - y - h, vy, height - y),
    )
    return any(
        gap <= margin and pace > 1.0 and way < EXIT_HORIZON_S * pace for gap, pace, way in edges
    )


def border_sides(region: Region, frame_size: tuple[int, int], margin: int = 3) -> frozenset[str]:
    """Sides of the image that a region reaches: 'left', 'top', 'right', 'bottom'."""
    return sides_of(region.bbox, frame_size, margin)


def sides_of(box: Box, frame_size: tuple[int, int], margin: int = 3) -> frozenset[str]:
    """Sides of the image that a box reaches."""
    x, y, w, h = box
    reached = {
        "left": x <= margin,
        "top": y <= margin,
        "right": x + w >= frame_size[0] - margin,
        "bottom": y + h >= frame_size[1] - margin,
    }
    return frozenset(side for side, at in reached.items() if at)


def at_border(region: Region, frame_size: tuple[int, int], margin: int = 3) -> bool:
    """Whether a region is cut by the image border, or nearly so."""
    return region.cut or bool(border_sides(region, frame_size, margin))


def _coherent(before: Region, after: Region) -> bool:
    near = box_intersection(expanded(before.bbox, 4), after.bbox) > 0
    ratio = after.area / max(before.area, 1.0)
    if before.cut and after.cut and ratio >= 2.5:
        # A region coming over the border appears in pieces that grow together: it is coherent while it
        # still covers its former place.
        return near and shared_pixels(before, after) > 0.6 * before.area
    return near and 0.4 < ratio < 2.5


def _reference_area(track: ObjectTrack, region: Region, dt: float, crowded: bool) -> float:
    if crowded:
        return track.reference_area
    if region.cut:
        return max(region.area, track.reference_area * exp(-dt / 8.0))
    return track.reference_area + (region.area - track.reference_area) * (1.0 - exp(-dt / 0.5))


def _recent_centroids(
    centroids: tuple[TimedCentroid, ...], new: TimedCentroid
) -> tuple[TimedCentroid, ...]:
    if centroids and new[0] - centroids[-1][0] < 1.0 / 16.0:
        return centroids
    since = new[0] - 1.0
    return (*[c for c in centroids if c[0] > since], new)[-16:]


def _velocity(
    track: ObjectTrack, region: Region, centroids: tuple[TimedCentroid, ...], dt: float
) -> tuple[float, float]:
    """(vx, vy), pixels per second: smoothed image motion where known, otherwise a line fitted to centroids.

    Image motion is preferred, since the centroid also moves when something unseen begins to hide the body.
    """
    if region.velocity_sigma > 0.0:
        share = max(1.0 - exp(-dt / 0.4), 1.0 / track.sightings)
        old, new = track.velocity, region.velocity
        return old[0] + share * (new[0] - old[0]), old[1] + share * (new[1] - old[1])
    if len(centroids) < 3:
        # Too few positions: retain the last velocity.
        return track.velocity
    middle = sum([t for t, _, _ in centroids]) / len(centroids)
    lever = sum([(t - middle) ** 2 for t, _, _ in centroids])
    along = sum([(t - middle) * x for t, x, _ in centroids])
    down = sum([(t - middle) * y for t, _, y in centroids])
    return along / lever, down / lever


def came_to(track: ObjectTrack, other: Region) -> bool:
    """Whether an object approached the centre of another one in the last second in which it was unobstructed.

    It is assumed that the camera hardly moved in that time.
    """
    if len(track.centroids) < MIN_SIGHTINGS:
        return False
    x, y = other.centroid
    (_, *first), *_, (_, *last) = track.centroids
    nearer = hypot(first[0] - x, first[1] - y) - hypot(last[0] - x, last[1] - y)
    return nearer > CAME_SHARE * sqrt(track.reference_area)
