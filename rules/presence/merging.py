"""Merging: two bodies that meet are soon segmented as one region.

An object recognised by appearance has its own region and absorbs no other.
"""

from __future__ import annotations

from visup.agent import ObjectBelief, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import shared_pixels, shifted_region
from visup.rules.presence.object_tracks import ObjectTrack
from visup.rules.presence.step_context import StepContext


def merge(context: StepContext) -> None:
    """Detect missing objects that merged with another one, whose region grew into the union of the two.

    Also moves merged objects along with the region that contains them, until that shrinks again.
    """
    recognised = context.recognised
    for gone in context.missing():
        track = context.tracks.get(gone.id)
        if track is None or gone.presence is not Presence.SEEN:
            continue
        if track.merged_with is not None:
            _move_with_host(context, gone, track)
            continue
        hosts = (b for b in context.seen() if b.id not in recognised)
        host = next((b for b in hosts if _has_absorbed(context, b, track)), None)
        if host is not None:
            merged_again = track.parted_at is not None and context.now - track.parted_at < 0.5
            since = track.merged_since if merged_again else context.now
            context.store(gone, merged_with=host.id, merged_since=since)


def _move_with_host(context: StepContext, gone: ObjectBelief, track: ObjectTrack) -> None:
    host = context.mind.objects.get(track.merged_with or -1)
    if host is None or host.presence is not Presence.SEEN:
        context.store(gone, merged_with=None, parted_at=context.now)
        return
    before = context.tracks[host.id].region
    if host.last_seen == context.now and host.region.area < 0.75 * before.area:
        # The host's region is its own again; the next frames will show where the other one is.
        context.store(gone, merged_with=None, parted_at=context.now, last_seen=context.now)
        return
    dx = host.region.centroid[0] - before.centroid[0]
    dy = host.region.centroid[1] - before.centroid[1]
    context.store(replace(gone, region=shifted_region(gone.region, dx, dy)), last_seen=context.now)


def _has_absorbed(context: StepContext, host: ObjectBelief, gone: ObjectTrack) -> bool:
    before = context.tracks.get(host.id)
    if before is None or not host.confirmed or gone.visible_share < context.settings.whole_share:
        return False
    # The host's track is as of its last sighting: both must have been seen until about the same time.
    if before.last_seen - gone.last_seen > context.settings.settle_s:
        return False
    parts = gone.region.area + before.region.area
    if host.region.area < before.region.area + 0.5 * gone.region.area:
        return False
    shared = shared_pixels(host.region, gone.region)
    shared += shared_pixels(host.region, before.region)
    return shared / (host.region.area + parts - shared) > 0.7
