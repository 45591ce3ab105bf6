"""Words for colours: what they mean, and that they stand in one table."""

from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.colour import ENTRIES, ColourBehaviour, palette
from visup.rules.traits.colours import SHADES, TERMS, colour_fit, colour_share
from visup.rules.traits.reasoner import Palette, blend_palettes
from visup.tasks.grammar.parser import grammar
from visup.testing.clips import region_of

SRGB = {
    "red": (220, 30, 30), "orange": (255, 140, 0), "yellow": (250, 220, 20), "green": (40, 160, 60),
    "blue": (30, 70, 200), "purple": (120, 30, 140), "pink": (255, 170, 190), "brown": (110, 65, 30),
    "white": (245, 245, 240), "black": (15, 15, 15), "grey": (128, 128, 128), "cyan": (0, 220, 230),
    "magenta": (230, 20, 220), "navy": (10, 15, 80), "beige": (225, 205, 170), "turquoise": (50, 210, 195),
    "maroon": (100, 10, 20), "gold": (215, 175, 40), "olive": (115, 115, 20), "silver": (190, 190, 192),
}  # fmt: skip
BASIC = (
    "red",
    "orange",
    "yellow",
    "green",
    "blue",
    "purple",
    "pink",
    "brown",
    "white",
    "black",
    "grey",
)
APART = [(a, b) for a in BASIC for b in BASIC if a != b]


def lab_of(rgb: tuple[int, int, int]) -> tuple[float, float, float]:
    pixel = np.array([[rgb[::-1]]], np.float32) / 255
    lightness, a, b = cv2.cvtColor(pixel, cv2.COLOR_BGR2Lab)[0, 0].tolist()
    return lightness, a, b


@pytest.mark.parametrize("name", SRGB)
def test_a_colour_is_called_by_its_name(name: str) -> None:
    assert colour_fit(name, *lab_of(SRGB[name])) == 1.0


@pytest.mark.parametrize(("one", "other"), APART)
def test_a_basic_colour_is_not_called_by_the_name_of_another(one: str, other: str) -> None:
    assert colour_fit(one, *lab_of(SRGB[other])) < 0.7


@pytest.mark.parametrize("name", ["red", "orange", "yellow", "green", "blue", "purple"])
@pytest.mark.parametrize("light", [0.55, 0.75, 1.0])
def test_a_colour_keeps_its_name_in_less_light(name: str, light: float) -> None:
    dimmed = tuple(round(255 * light * (c / 255)) for c in SRGB[name])
    fit = colour_fit(name, *lab_of((dimmed[0], dimmed[1], dimmed[2])))
    assert fit > 0.5 or (name, light) in {("orange", 0.55), ("yellow", 0.55)}  # brown, olive then


@given(
    st.sampled_from(list(TERMS)),
    st.sampled_from(["", *SHADES]),
    st.floats(0, 100),
    st.floats(-120, 120),
    st.floats(-120, 120),
)
def test_fits_are_shares_and_shades_narrow_them(
    word: str, shade: str, lightness: float, a: float, b: float
) -> None:
    plain = colour_fit(word, lightness, a, b)
    assert 0.0 <= plain <= 1.0
    light, dark = (colour_fit(f"{s} {word}", lightness, a, b) for s in ("light", "dark"))
    assert min(light, dark) == 0.0 or lightness > 40  # nothing is both
    assert light <= plain + 1e-9 or TERMS[word].lightness[1] < 100


def test_the_grammar_knows_the_same_words() -> None:
    (said,) = re.findall(r"^COLOUR\.1: /\(([\w|]+)\)", grammar(), re.M)
    (shaded,) = re.findall(r"^SHADE\.1: /\(([\w|]+)\)\(\?=\\s\+\(([\w|]+)\)", grammar(), re.M)
    assert set(said.split("|")) == set(TERMS)
    assert set(shaded[0].split("|")) == set(SHADES)
    assert shaded[1] == said


def test_a_palette_tells_the_inside_and_its_shares() -> None:
    image = np.full((60, 80, 3), (40, 160, 60), np.uint8)
    image[20:40, 20:60] = (30, 30, 220)
    image[20:40, 50:60] = (245, 245, 245)
    mask = np.zeros((60, 80), bool)
    mask[19:41, 19:61] = True  # too large by a pixel all round
    found = palette(image, region_of(mask))
    assert 0 < len(found) <= ENTRIES
    assert colour_share("red", found) == pytest.approx(0.75, abs=0.08)
    assert colour_share("white", found) == pytest.approx(0.25, abs=0.08)
    assert colour_share("green", found) < 0.05


def test_what_lies_outside_the_image_has_no_colour() -> None:
    mask = np.ones((10, 10), bool)
    region = region_of(mask, at=(100, 100), size=(200, 200))
    assert palette(np.zeros((50, 50, 3), np.uint8), region) == ()
    assert ColourBehaviour.contract.every_s == 0.2


entries = st.lists(
    st.tuples(st.sampled_from([10.0, 50.0]), st.just(0.0), st.just(0.0), st.just(0.5)),
    min_size=1, max_size=2, unique_by=lambda e: e[0],
).map(tuple)  # fmt: skip


@given(entries, entries, st.floats(0, 1))
def test_blending_keeps_shares(one: Palette, other: Palette, weight: float) -> None:
    shares = [sum(e[3] for e in p) for p in (blend_palettes(one, other, weight), one, other)]
    assert shares[0] == pytest.approx((1 - weight) * shares[1] + weight * shares[2])
    assert blend_palettes((), other, weight) == other
