"""RCC-5 and RCC-2 in rules are those of the calculi by their definitions, whichever of the eight holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from visup.rules.calculi.rcc import COARSER
from visup.rules.calculi.rcc import RCC8 as SIGNS
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.regions import RCC8
from visup.rules.predicates.vocabulary import PREDICATES

WORDS = {"dr": "discrete", "pp": "proper_part", "ppi": "proper_part_inverse"}


@dataclass
class Facts:
    """One pair of which one relation of RCC-8 holds, or none is known."""

    holds: str | None

    def relation_codes(self, name: str) -> Any:
        code = MAYBE if self.holds is None else YES if name == self.holds else NO
        return np.array([[NO, code], [code, NO]], dtype=np.int8)


def code(word: str, holds: str | None) -> int:
    facts: Any = Facts(holds)
    return int(PREDICATES[word].evaluate(facts)[0, 1])


@pytest.mark.parametrize(("name", "sign"), list(zip(RCC8, SIGNS, strict=True)))
def test_coarse_relations_are_unions_of_rcc8(name: str, sign: str) -> None:
    five, two = COARSER["RCC5"][sign], COARSER["RCC2"][sign]
    for relation, word in WORDS.items():
        assert code(word, name) == (YES if five == relation else NO), word
    assert code("connected", name) == (YES if two == "c" else NO)
    assert code("overlapping", name) == -code("discrete", name)


@pytest.mark.parametrize("word", [*WORDS.values(), "connected", "overlapping"])
def test_unions_of_unknown_rcc8_relations_are_unknown(word: str) -> None:
    assert code(word, None) == MAYBE
