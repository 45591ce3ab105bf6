"""Thresholds of presence reasoning: durations before state changes, and visible shares."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PresenceSettings:
    """Durations before changes are reported, in seconds, and visible shares, 0 to 1.

    Attributes:
        entry_s: A region that came over the border, or was present at the start, enters after this.
        entry_inside_s: The same for one that appears inside the image.
        start_s: Time from the first frame in which a new region counts as present from the start.
        least_sightings: Sightings required for entry.
        allowed_gap_s: Longest gap between sightings that does not interrupt a steady observation.
        settle_s: How long an object must be missing before exit or occlusion is reported.
        missed_s: The same for occlusion if the other object covers only a part of it.
        lost_s: The same for loss, when nothing explains that it is missing.
        partial_s: How long little must be visible before exit or occlusion is reported.
        hidden_share: Below this visible share, next to another region, an object is occluded.
        leaving_share: Below this visible share, moving over the border, it has left.
        shown_share: Above this visible share a hidden object has reappeared.
        shown_s: How long it must be visible, or unobstructed, before that is reported.
        whole_share: Least visible share, when last seen, of an object that may have merged with another; a
            less visible one was being hidden.
        contact_px: Gap below which regions may hide parts of each other, pixels.
        reidentify_s: How long a new region must be seen before it can be a hidden object.
        least_share: Share of the image below which an unrecognised region does not enter.
        sure_similarity: Similarity from which an object recognised by appearance in the first frame enters at
            once.
    """

    entry_s: float = 0.36
    entry_inside_s: float = 1.0
    start_s: float = 2.0
    least_sightings: int = 3
    allowed_gap_s: float = 0.25
    settle_s: float = 0.3
    missed_s: float = 0.9
    lost_s: float = 2.0
    partial_s: float = 0.16
    hidden_share: float = 0.2
    leaving_share: float = 0.12
    shown_share: float = 0.5
    shown_s: float = 0.12
    whole_share: float = 0.6
    contact_px: float = 4.0
    reidentify_s: float = 0.12
    least_share: float = 0.0005
    sure_similarity: float = 0.7
