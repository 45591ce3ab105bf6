"""Contact of bodies whose outlines meet in the image, as opposed to passing in front or behind.

Outlines that meet need not be in contact; what happens next decides. A body in contact comes to rest relative
to the other, takes it along, or bounces back; one that continues as fast as it came passes in front of the
other, or behind it. A carried body whose lowest point (foot) comes down below the foot of the other is in
front of it: a body that stands on the other, or in it, has its foot higher in the image, as seen from
anywhere above the ground.

*Approximation*: a body that is hung up under another one, coming from above, counts as in front of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from visup.agent.model.fast_replace import replace


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """Settings of contact.

    Attributes:
        passing: Relative speed above which one body passes the other, image diagonals per second.
        passing_share: The same as a share of the speed at which both move.
        slowed_share: The same as a share of their greatest relative speed since they met: braking indicates
            contact.
        sure_share: The same, lower, for a speed that is known well: a body that is brought alongside with
            care has braked to less before they meet.
        sure_sigmas: Standard deviations by which such a speed must exceed that.
        contact_s: How long they must not pass each other to be in contact, seconds.
        unknown_s: How long outlines must meet to be in contact while their motion is unknown, seconds.
        doubt_share: Distance moved across the other, in sizes of the smaller one, from which a passing body
            is assumed to be in front of the other or behind it.
        below_share: How far the foot of a carried body must be below that of the other one to be in front of
            it, as a share of its height.
    """

    passing: float = 0.0125
    passing_share: float = 0.5
    slowed_share: float = 0.4
    sure_share: float = 0.15
    sure_sigmas: float = 3.0
    contact_s: float = 0.15
    unknown_s: float = 0.5
    doubt_share: float = 0.4
    below_share: float = 0.25


class Feet(NamedTuple):
    """The lowest points of two bodies in the image, of which one is carried by a third.

    Attributes:
        carried: Lowest point of the carried body, y downwards in pixels.
        other: Lowest point of the other body, y downwards in pixels.
        height: Height of the carried body, pixels.
    """

    carried: float
    other: float
    height: float


@dataclass(frozen=True, slots=True)
class OutlineContact:
    """The memory of two bodies whose outlines meet; seconds and pixels.

    Attributes:
        met_at: Time since when they meet.
        confirmed_since: Time since when they are in contact (settled), or None.
        path: Distance that one has moved across the other in the current passage; 0 while none passes.
        passing: Whether one was last observed passing the other.
        changed_at: Time since when `passing` has its value.
        motion_known: Whether their relative motion is known, or was known at most `unknown_s` ago.
        motion_known_at: Time when it was last known, or when they met.
        top_speed: Their greatest relative speed since they met, pixels per second.
        highest_foot: Highest foot of the carried body since they met: the least y, downwards in pixels.
        lowest_foot: Lowest foot of the other body since they met (the greatest y), since a body in front of
            it may hide its foot.
        in_front: Whether the carried body has come down below `lowest_foot`: it is in front of the other.
    """

    met_at: float
    confirmed_since: float | None = None
    path: float = 0.0
    passing: bool = False
    changed_at: float = 0.0
    motion_known: bool = False
    motion_known_at: float = 0.0
    top_speed: float = 0.0
    highest_foot: float = math.inf
    lowest_foot: float = -math.inf
    in_front: bool = False


def update_contact(
    before: OutlineContact | None,
    speed: float | None,
    limit: float,
    moment: tuple[float, float],
    settings: ContactSettings,
    *,
    sigma: float = math.inf,
    thrown_back: bool = False,
    feet: Feet | None = None,
) -> OutlineContact:
    """Update the contact of two bodies whose outlines meet.

    Args:
        before: The previous contact; None if they did not meet before.
        speed: Relative speed, pixels per second; None when unknown.
        limit: Speed above which one passes the other, pixels per second.
        moment: (current time, time since the previous update), seconds.
        settings: Settings.
        sigma: Standard deviation of the speed, pixels per second.
        thrown_back: Whether they separate on the side on which they met, which implies contact.
        feet: The feet of the two, if a third body carries one of them.
    """
    now, dt = moment
    contact = before or OutlineContact(now, changed_at=now, motion_known_at=now)
    if (
        speed is None
        and contact.motion_known
        and now - contact.motion_known_at >= settings.unknown_s - 1e-6
    ):
        # One may be hidden behind the other. It is not passing: then it would have come out again by now.
        contact = replace(
            contact, motion_known=False, passing=False, path=0.0, met_at=contact.motion_known_at
        )
    if speed is not None:
        contact = replace(contact, top_speed=max(contact.top_speed, speed), motion_known_at=now)
        passing = speed > max(limit, settings.slowed_share * contact.top_speed)
        least = max(limit, settings.sure_share * contact.top_speed)
        passing |= speed - settings.sure_sigmas * sigma > least
        if passing is not contact.passing or not contact.motion_known:
            contact = replace(contact, passing=passing, changed_at=now, motion_known=True)
        path = contact.path + speed * dt if passing else 0.0
        contact = replace(contact, path=path) if path != contact.path else contact
    if feet is not None:
        contact = _with_feet(contact, feet, settings)
    if contact.in_front:
        return replace(contact, confirmed_since=None)
    if thrown_back:
        since = contact.met_at if contact.confirmed_since is None else contact.confirmed_since
        return replace(contact, confirmed_since=since, passing=False, path=0.0)
    if contact.passing:
        return (
            contact if contact.confirmed_since is None else replace(contact, confirmed_since=None)
        )
    lasted = now - (contact.changed_at if contact.motion_known else contact.met_at)
    least = settings.contact_s if contact.motion_known else settings.unknown_s
    if contact.confirmed_since is None and lasted >= least - 1e-6:
        return replace(contact, confirmed_since=now)
    return contact


def _with_feet(contact: OutlineContact, feet: Feet, settings: ContactSettings) -> OutlineContact:
    """The contact updated with the feet of both bodies."""
    highest, ground = min(contact.highest_foot, feet.carried), max(contact.lowest_foot, feet.other)
    below = feet.carried > ground + settings.below_share * feet.height
    return replace(
        contact, highest_foot=highest, lowest_foot=ground, in_front=below and highest <= ground
    )
