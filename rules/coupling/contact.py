"""Contact of bodies whose outlines meet in the image, as opposed to passing in front or behind.

Outlines that meet need not be in contact; what happens next decides. A body in contact comes to rest relative
to the other, takes it along, or bounces back; one that continues as fast as it came passes in front of the
other, or behind it. What stops abruptly as outlines meet has touched; what slows down gently, as a boat does
that is brought alongside, has touched once it rests. A carried body whose lowest point (foot) comes down
below the foot of the other is in front of it: a body that stands on the other, or in it, has its foot higher
in the image, as seen from anywhere above the ground.

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
        rest: Relative speed below which two bodies that nothing carries rest at each other, image diagonals
            per second.
        rest_sigmas: Standard deviations by which such a speed must exceed that.
        rest_share: The same as a share of their greatest relative speed since they met.
        fast_share: Share of that speed above which they move fast.
        abrupt_s: Longest time in which a body that moves fast stops abruptly, seconds.
        slow_s: How long bodies that slow down gently must be slow to be in contact, if they do not rest.
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
    rest: float = 0.006
    rest_sigmas: float = 1.0
    rest_share: float = 0.05
    fast_share: float = 0.75
    abrupt_s: float = 0.35
    slow_s: float = 0.8
    contact_s: float = 0.15
    unknown_s: float = 0.5
    doubt_share: float = 0.4
    below_share: float = 0.25


class RelativeSpeed(NamedTuple):
    """How fast two bodies move relative to each other, in pixels per second.

    Attributes:
        speed: Relative speed; None when unknown.
        sigma: Standard deviation of the speed.
        limit: Speed above which one passes the other.
        rest: Speed above which neither rests at the other.
    """

    speed: float | None
    limit: float
    sigma: float = math.inf
    rest: float = math.inf

    def exceeds(self, limit: float, sigmas: float) -> bool:
        """Whether the speed is known, and exceeds a limit by some standard deviations."""
        return self.speed is not None and self.speed - sigmas * self.sigma > limit


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
        fast_at: Time when they last moved fast relative to each other, before they slowed down.
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
    fast_at: float = -math.inf
    highest_foot: float = math.inf
    lowest_foot: float = -math.inf
    in_front: bool = False


def update_contact(
    before: OutlineContact | None,
    motion: RelativeSpeed,
    moment: tuple[float, float],
    settings: ContactSettings,
    *,
    thrown_back: bool = False,
    feet: Feet | None = None,
) -> OutlineContact:
    """Update the contact of two bodies whose outlines meet.

    Args:
        before: The previous contact; None if they did not meet before.
        motion: Their relative speed.
        moment: (current time, time since the previous update), seconds.
        settings: Settings.
        thrown_back: Whether they separate on the side on which they met, which implies contact.
        feet: The feet of the two, if a third body carries one of them.
    """
    now = moment[0]
    contact = before or OutlineContact(now, changed_at=now, motion_known_at=now)
    if motion.speed is not None:
        contact = _with_speed(contact, motion, motion.speed, moment, settings)
    elif contact.motion_known and now - contact.motion_known_at >= settings.unknown_s - 1e-6:
        # One may be hidden behind the other. It is not passing: then it would have come out again by now.
        contact = replace(
            contact, motion_known=False, passing=False, path=0.0, met_at=contact.motion_known_at
        )
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
    if contact.confirmed_since is None and lasted >= _required(contact, motion, settings) - 1e-6:
        return replace(contact, confirmed_since=now)
    return contact


def _with_speed(
    contact: OutlineContact,
    motion: RelativeSpeed,
    speed: float,
    moment: tuple[float, float],
    settings: ContactSettings,
) -> OutlineContact:
    """The contact updated with a known relative speed: whether one passes the other."""
    now, dt = moment
    top = max(contact.top_speed, speed)
    fast_at = now if speed > settings.fast_share * top else contact.fast_at
    contact = replace(contact, top_speed=top, motion_known_at=now, fast_at=fast_at)
    passing = speed > max(motion.limit, settings.slowed_share * top)
    passing |= motion.exceeds(max(motion.limit, settings.sure_share * top), settings.sure_sigmas)
    if passing is not contact.passing or not contact.motion_known:
        contact = replace(contact, passing=passing, changed_at=now, motion_known=True)
    path = contact.path + speed * dt if passing else 0.0
    return replace(contact, path=path) if path != contact.path else contact


def _required(contact: OutlineContact, motion: RelativeSpeed, settings: ContactSettings) -> float:
    """How long two bodies must not pass each other to be in contact, seconds."""
    if not contact.motion_known:
        return settings.unknown_s
    gently = contact.changed_at - contact.fast_at > settings.abrupt_s
    rest = max(motion.rest, settings.rest_share * contact.top_speed)
    moves = motion.exceeds(rest, settings.rest_sigmas)
    return settings.slow_s if gently and moves else settings.contact_s


def _with_feet(contact: OutlineContact, feet: Feet, settings: ContactSettings) -> OutlineContact:
    """The contact updated with the feet of both bodies."""
    highest, ground = min(contact.highest_foot, feet.carried), max(contact.lowest_foot, feet.other)
    below = feet.carried > ground + settings.below_share * feet.height
    return replace(
        contact, highest_foot=highest, lowest_foot=ground, in_front=below and highest <= ground
    )
