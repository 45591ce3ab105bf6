"""Contact that is meant: outlines that meet in the image, of bodies that do not pass each other.

Touching in the picture is not touching. What happens next tells: of two that meet, one comes to rest at the
other, takes it along, or is thrown back; what goes on past the other as fast as it came is in front of it, or
behind.
"""

from __future__ import annotations

from dataclasses import dataclass

from visup.agent.model.fast_replace import replace


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """When outlines that meet are in contact.

    Attributes:
        passing: Relative speed from which on one passes the other, image diagonals per second; and
        passing_share: the same as a share of the speed at which both move; and
        slowed_share: as a share of the speed with which they met: what brakes at the other means it.
        settled_s: For how long they must not pass each other to have settled.
        unknown_s: Outlines that meet for so long while nothing is known of their motion have settled.
        doubt_share: One that has passed so far across the other, in sizes of the smaller one, is believed
            to be in front of it or behind.
    """

    passing: float = 0.0125
    passing_share: float = 0.5
    slowed_share: float = 0.4
    settled_s: float = 0.15
    unknown_s: float = 0.5
    doubt_share: float = 0.4


@dataclass(frozen=True, slots=True)
class OutlineContact:
    """What is remembered of two whose outlines meet; seconds and pixels.

    Attributes:
        met_at: Since when they meet.
        settled_since: Since when they rest at each other, or None.
        path: How far one has passed across the other since it last did not.
        passing: Whether one was last seen to pass the other, and
        changed_at: since when that is as it is.
        known: Whether their relative motion was ever known since they meet.
        fastest: Their greatest relative speed since, pixels per second.
    """

    met_at: float
    settled_since: float | None = None
    path: float = 0.0
    passing: bool = False
    changed_at: float = 0.0
    known: bool = False
    fastest: float = 0.0


def updated_contact(
    before: OutlineContact | None,
    speed: float | None,
    limit: float,
    moment: tuple[float, float],
    settings: ContactSettings,
    *,
    thrown_back: bool = False,
) -> OutlineContact:
    """What is believed of two whose outlines meet after another look.

    Args:
        before: What was believed; None when they did not meet before.
        speed: Relative, pixels per second; None when it is not known.
        limit: From which speed on one passes the other, pixels per second.
        moment: Seconds now, and since the look before.
        settings: Patience.
        thrown_back: Whether they part again on the side on which they met: that is contact made.
    """
    now, dt = moment
    contact = before or OutlineContact(now, changed_at=now)
    if speed is not None:
        contact = replace(contact, fastest=max(contact.fastest, speed))
        passing = speed > max(limit, settings.slowed_share * contact.fastest)
        if passing is not contact.passing or not contact.known:
            contact = replace(contact, passing=passing, changed_at=now, known=True)
        path = contact.path + speed * dt if passing else 0.0
        contact = replace(contact, path=path) if path != contact.path else contact
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
