"""Contact of outlines that meet in the image, as opposed to bodies passing each other.

Touching in the picture is not touching. The continuation decides: a body in contact comes to rest at the
other, takes it along, or bounces back; one that goes on as fast as it came passes in front of the other, or
behind it. What is carried, and comes down past the foot of the other, is in front of it: what stands on
another body, or in it, has its foot above the foot of that, seen from anywhere above the ground.

*Approximation*: what is hung up under another thing, from above, counts as in front of it.
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
        passing: Relative speed from which one passes the other, image diagonals per second.
        passing_share: The same as a share of the speed at which both move.
        slowed_share: The same as a share of the speed at which they met: braking indicates contact.
        sure_share: The same where the velocity is known well: what eases alongside brakes long before; and
        sure_sigmas: by how many standard deviations the speed must lie above that.
        settled_s: How long they must not pass each other to have settled.
        unknown_s: How long outlines must meet to have settled while their motion is unknown.
        doubt_share: Distance passed across the other, in sizes of the smaller one, from which one is
            assumed in front of the other or behind it.
        below_share: How far the foot of what is carried must be below that of the other to be in front of
            it, as a share of its height.
    """

    passing: float = 0.0125
    passing_share: float = 0.5
    slowed_share: float = 0.4
    sure_share: float = 0.15
    sure_sigmas: float = 3.0
    settled_s: float = 0.15
    unknown_s: float = 0.5
    doubt_share: float = 0.4
    below_share: float = 0.25


class Feet(NamedTuple):
    """The lowest points of two bodies in the image, y in pixels.

    Attributes:
        carried: Of the one that is carried.
        other: Of the other one.
        height: Height of the carried one, pixels.
    """

    carried: float
    other: float
    height: float


@dataclass(frozen=True, slots=True)
class OutlineContact:
    """The memory of two bodies whose outlines meet; seconds and pixels.

    Attributes:
        met_at: Since when they meet.
        settled_since: Since when they are settled, or None.
        path: How far one has passed across the other since it last did not.
        passing: Whether one was last observed passing the other.
        changed_at: Since when `passing` has its value.
        known: Whether their relative motion is known, or was at most `unknown_s` ago.
        known_at: When it was last known, or when they met.
        fastest: Their greatest relative speed since, pixels per second.
        highest: The highest foot of the one that is carried since they meet, y in pixels.
        ground: The lowest foot of the other since then; what covers it hides its foot.
        in_front: Whether what is carried has come down past that: it is in front of the other.
    """

    met_at: float
    settled_since: float | None = None
    path: float = 0.0
    passing: bool = False
    changed_at: float = 0.0
    known: bool = False
    known_at: float = 0.0
    fastest: float = 0.0
    highest: float = math.inf
    ground: float = -math.inf
    in_front: bool = False


def updated_contact(
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
        limit: Speed from which one passes the other, pixels per second.
        moment: Current time, and time since the previous update, seconds.
        settings: Settings.
        sigma: Standard deviation of the speed, pixels per second.
        thrown_back: Whether they separate on the side on which they met, which implies contact.
        feet: Of the two, if a third body carries one of them.
    """
    now, dt = moment
    contact = before or OutlineContact(now, changed_at=now, known_at=now)
    if speed is None and contact.known and now - contact.known_at >= settings.unknown_s - 1e-6:
        # Hidden in the other, say: had it gone on, it would have come out again.
        contact = replace(contact, known=False, passing=False, path=0.0, met_at=contact.known_at)
    if speed is not None:
        contact = replace(contact, fastest=max(contact.fastest, speed), known_at=now)
        passing = speed > max(limit, settings.slowed_share * contact.fastest)
        least = max(limit, settings.sure_share * contact.fastest)
        passing |= speed - settings.sure_sigmas * sigma > least
        if passing is not contact.passing or not contact.known:
            contact = replace(contact, passing=passing, changed_at=now, known=True)
        path = contact.path + speed * dt if passing else 0.0
        contact = replace(contact, path=path) if path != contact.path else contact
    if feet is not None:
        contact = _with_feet(contact, feet, settings)
    if contact.in_front:
        return replace(contact, settled_since=None)
    if thrown_back:
        since = contact.met_at if contact.settled_since is None else contact.settled_since
        return replace(contact, settled_since=since, passing=False, path=0.0)
    if contact.passing:
        return contact if contact.settled_since is None else replace(contact, settled_since=None)
    lasted = now - (contact.changed_at if contact.known else contact.met_at)
    least = settings.settled_s if contact.known else settings.unknown_s
    if contact.settled_since is None and lasted >= least - 1e-6:
        return replace(contact, settled_since=now)
    return contact


def _with_feet(contact: OutlineContact, feet: Feet, settings: ContactSettings) -> OutlineContact:
    """The contact after a look at the feet of both."""
    highest, ground = min(contact.highest, feet.carried), max(contact.ground, feet.other)
    below = feet.carried > ground + settings.below_share * feet.height
    return replace(contact, highest=highest, ground=ground, in_front=below and highest <= ground)
