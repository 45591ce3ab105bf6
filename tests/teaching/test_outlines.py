"""Outlines as they are typed: every way of writing corners, and what is said of those that are none."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model.errors import SettingsError
from visup.teaching.outlines import join_corners, parse_outline

NUMBERS = st.floats(-500, 5000, allow_nan=False).map(lambda n: round(n, 3))
CORNERS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=3, max_size=9)
FORMS = ("{x},{y}", "({x}, {y})", "[{x},{y}]", "{x} , {y}", "( {x} {y} )")


@given(CORNERS, st.sampled_from(FORMS), st.sampled_from((" ", "; ", ", ", "\n", "  ")))
def test_corners_can_be_written_in_several_ways(
    corners: list[tuple[float, float]], form: str, between: str
) -> None:
    text = between.join(form.format(x=x, y=y) for x, y in corners)
    outline = parse_outline(f" the part = {text} ")
    assert outline.name == "the part"
    assert outline.corners == tuple(corners)


@given(CORNERS, st.booleans())
def test_quotes_around_corners_are_optional(
    corners: list[tuple[float, float]], glued: bool
) -> None:
    words = [f"{x},{y}" for x, y in corners]
    words[0] = f"part={words[0]}"
    flag = ["--outline", words[0]] if not glued else [f"--outline={words[0]}"]
    joined = join_corners(["clip.mp4", *flag, *words[1:], "--frame", "3"])
    assert joined[-2:] == ["--frame", "3"]
    assert len(joined) == (5 if not glued else 4)
    assert parse_outline(joined[-3].removeprefix("--outline=")).corners == tuple(corners)


def test_consecutive_outlines_are_kept_apart() -> None:
    words = ["--outline", "a=1,2", "3,4", "5,6", "--outline", "b=1,2", "3,4", "5,6", "clip.mp4"]
    expected = ["--outline", "a=1,2 3,4 5,6", "--outline", "b=1,2 3,4 5,6", "clip.mp4"]
    assert join_corners(words) == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no name"),
        ("part", "has no name"),
        ("=1,2 3,4 5,6", "has no name"),
        ("part=", "too few corners: 0"),
        ("part=1,2 3,4", "too few corners: 2"),
        ("part=1,2 3,4 5", "cannot be read at '5'"),
        ("part=1,2 3,4 a,b", "cannot be read at 'a,b'"),
        ("part=1,2 3,4 5,6 and so on", "cannot be read at 'and so on'"),
        ("part=1,2 3,4 1e999,6", "nowhere"),
        ("part=nan,2 3,4 5,6", "cannot be read at 'nan,2 3,4 5,6'"),
    ],
)
def test_an_invalid_outline_is_reported(text: str, message: str) -> None:
    with pytest.raises(SettingsError) as refused:
        parse_outline(text)
    assert message in refused.value.what
