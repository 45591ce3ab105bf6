"""An object may go up in the region of another: two bodies that meet are soon seen as one."""

from __future__ import annotations

from visup.agent import ObjectBelief, Presence
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import shared_pixels, shifted_region
from visup.rules.presence.object_tracks import ObjectTrack
from visup.rules.presence.step_context import StepContext


def merge(work: StepContext) -> None:
    """Find objects that went up in a region grown into the union of two."""
    for gone in work.missing():
        track = work.of.get(gone.id)
        if track is None or track.told != "seen":
            continue
        if track.merged_with is not None:
            _stay_merged(work, gone, track)
            continue
        host = next((b for b in work.seen() if _has_absorbed(work, b, track)), None)
        if host is not None:
            again = track.parted_at is not None and work.now - track.parted_at < 0.5
            since = track.merged_since if again else work.now
            work.put(gone, merged_with=host.id, merged_since=since)


def _stay_merged(work: StepContext, gone: ObjectBelief, track: ObjectTrack) -> None:
    host = work.mind.objects.get(track.merged_with or -1)
    if host is None or host.presence is not Presence.SEEN:
        work.put(gone, merged_with=None, parted_at=work.now)
        return
    before = work.of[host.id].region
    if host.last_seen == work.now and host.region.area < 0.75 * before.area:
        # The host's region is its own again; where the other one is shows in the next frames.
        work.put(gone, merged_with=None, parted_at=work.now, seen_at=work.now)
        return
    dx = host.region.centroid[0] - before.centroid[0]
    dy = host.region.centroid[1] - before.centroid[1]
    work.put(replace(gone, region=shifted_region(gone.region, dx, dy)), seen_at=work.now)


def _has_absorbed(work: StepContext, host: ObjectBelief, gone: ObjectTrack) -> bool:
    before = work.of.get(host.id)
    if before is None or not host.confirmed or gone.visible < work.settings.whole_share:
        return False
    # The host's track stands still since its last sight: both were seen until much the same time.
    if before.seen_at - gone.seen_at > work.settings.settle_s:
        return False
    parts = gone.region.area + before.region.area
    if host.region.area < before.region.area + 0.5 * gone.region.area:
        return False
    shared = shared_pixels(host.region, gone.region)
    shared += shared_pixels(host.region, before.region)
    return shared / (host.region.area + parts - shared) > 0.7
