"""Outlines that meet: what passes by is no contact, what comes to rest is."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from visup.rules.coupling.contact import ContactSettings, OutlineContact, update_contact

SETTINGS = ContactSettings()
LIMIT, DT = 10.0, 0.1

speeds = st.lists(st.one_of(st.none(), st.floats(0, 40)), min_size=1, max_size=30)


def seen(speeds: Sequence[float | None]) -> OutlineContact:
    contact = None
    for k, speed in enumerate(speeds):
        contact = update_contact(contact, speed, LIMIT, (k * DT, DT), SETTINGS)
    assert contact is not None
    return contact


def test_what_comes_to_rest_at_another_settles() -> None:
    assert seen([30.0, 20.0, 5.0, 1.0, 0.0]).confirmed_since is not None


def test_what_passes_by_never_settles_and_its_path_grows() -> None:
    contact = seen([30.0] * 10)
    assert contact.confirmed_since is None
    assert contact.path > 25.0


def test_what_moves_on_has_settled_no_more() -> None:
    assert seen([0.0] * 5 + [30.0]).confirmed_since is None


def eased(sigma: float) -> OutlineContact:
    """A boat that eases alongside: it keeps a fifth of its speed for a while, known to within `sigma`."""
    contact = None
    for k, speed in enumerate([100.0] * 5 + [20.0] * 5):
        contact = update_contact(contact, speed, LIMIT, (k * DT, DT), SETTINGS, sigma=sigma)
    assert contact is not None
    return contact


def test_what_eases_alongside_settles_late_where_its_velocity_is_known_well() -> None:
    assert eased(sigma=0.5).confirmed_since is None
    assert eased(sigma=5.0).confirmed_since is not None
    assert eased(sigma=math.inf) == seen([100.0] * 5 + [20.0] * 5)


@given(st.lists(st.floats(0, 40), min_size=1, max_size=30), st.floats(0, 20), st.floats(0, 20))
def test_nobody_settles_earlier_for_knowing_better(
    told: list[float], one: float, more: float
) -> None:
    kept: list[OutlineContact | None] = [None, None]
    for k, speed in enumerate(told):
        moment = k * DT, DT
        kept = [
            update_contact(c, speed, LIMIT, moment, SETTINGS, sigma=sigma)
            for c, sigma in zip(kept, (one, one + more), strict=True)
        ]
        well, badly = kept
        assert well is not None
        assert badly is not None
        assert well.passing >= badly.passing


def test_where_nothing_is_known_of_their_motion_it_settles_later() -> None:
    assert seen([None] * 3).confirmed_since is None
    assert seen([None] * 7).confirmed_since is not None


def test_what_is_not_seen_to_move_on_any_more_settles() -> None:
    """A parcel that falls into a bin is hidden by it: had it gone on, it would have come out again."""
    assert seen([30.0] * 5 + [None] * 3).passing
    hidden = seen([30.0] * 5 + [None] * 8)
    assert not hidden.passing
    assert hidden.confirmed_since is not None
    assert seen([30.0] * 5 + [None] * 8 + [30.0]).confirmed_since is None


@given(speeds)
def test_what_is_thrown_back_has_made_contact(told: list[float | None]) -> None:
    contact = update_contact(seen(told), 30.0, LIMIT, (9.0, DT), SETTINGS, thrown_back=True)
    assert contact.confirmed_since is not None
    assert not contact.passing


@given(speeds)
def test_nobody_settles_while_passing(told: list[float | None]) -> None:
    contact = seen(told)
    assert not (contact.passing and contact.confirmed_since is not None)
    assert contact.path >= 0.0
    assert contact.passing or contact.path == 0.0


@given(speeds, st.floats(0.0, LIMIT))
def test_rest_ends_every_passing(told: list[float | None], slow: float) -> None:
    contact = seen([*told, slow, slow, slow])
    assert contact.confirmed_since is not None
    assert contact.path == 0.0
