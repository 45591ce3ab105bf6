"""Sentences say as much as is known: every event and relation, in every band of confidence."""

from __future__ import annotations

import ast
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import visup.rules
from tests.rules.runs import think
from tests.rules.scenes import box_region, seen
from visup.agent import Event, Mind
from visup.rules.reasoners import default_reasoners
from visup.rules.wording.relation_events import TEMPLATES
from visup.rules.wording.sentences import LIKELY, SURE, VERBS, graded, mentions, sentence

BANDS = {1.0: 0, 0.95: 0, 0.94: 1, 0.5: 1, 0.49: 2, 0.0: 2}
REPORTED_LIKELIHOOD = {
    "is": ("is", "appears to be", "may be"),
    "are": ("are", "appear to be", "may be"),
    "enters": ("enters", "appears to enter", "may enter"),
    "leaves": ("leaves", "appears to leave", "may leave"),
    "comes": ("comes", "appears to come", "may come"),
    "begins": ("begins", "appears to begin", "may begin"),
    "reappears": ("reappears", "appears to reappear", "may reappear"),
}


@cache
def templates() -> list[str]:
    """All sentences about objects that stand in the rules' sources."""
    found = []
    for path in sorted(Path(visup.rules.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found += [node.value] if node.value.startswith("{0}") else []
    return found


@pytest.mark.parametrize("verb", sorted(VERBS))
@pytest.mark.parametrize("confidence", BANDS)
def test_a_verb_is_as_strong_as_its_confidence(verb: str, confidence: float) -> None:
    assert graded(verb, confidence) == REPORTED_LIKELIHOOD[verb][BANDS[confidence]]


def test_every_sentence_about_objects_has_a_verb_that_is_graded() -> None:
    every = templates()
    assert len(every) >= 12
    assert set(TEMPLATES.values()) <= set(every)
    for template in every:
        assert VERBS & set(mentions(template)), template


@pytest.mark.parametrize("confidence", BANDS)
def test_all_sentences_keep_their_words_in_every_band(confidence: float) -> None:
    band = BANDS[confidence]
    for template in templates():
        said = sentence(Mind(0.0, 0, (640, 480)), template, 1, 2, confidence=confidence)
        (verb,) = VERBS & set(mentions(template))
        assert REPORTED_LIKELIHOOD[verb][band] in said, template
        assert "{" not in said
        assert said[0].isupper()


def told(confidence: float) -> list[Event]:
    """One box rests; another comes and hides it; regions are as sure as told."""
    rules = default_reasoners()

    def at(i: int) -> list[Event]:
        left = -220 + 6 * (i - 25)
        passing = box_region(2, (left, 100, 200, 200)) if i >= 25 else None
        begin = max(200, left + 200) if left < 300 else 200
        rest = box_region(1, (begin, 150, 300 - begin, 80)) if begin < 300 else None
        both = [replace(r, confidence=confidence) if r else None for r in (rest, passing)]
        return [seen(i, both)]  # type: ignore[list-item]

    looks = [o for i in range(150) for o in at(i)]
    return [e for t in think((*rules.update, *rules.cogitate), looks) for e in t.events]  # type: ignore[arg-type]


def test_what_happens_is_told_with_the_confidence_of_its_event() -> None:
    verbs = {"entry": ("is", "enters"), "occlusion": ("is",)}
    for confidence in (1.0, 0.3):
        events = [e for e in told(confidence) if e.kind in verbs]
        assert {"entry", "occlusion"} <= {e.kind for e in events}
        for event in events:
            band = 0 if event.confidence >= SURE else 1 if event.confidence >= LIKELY else 2
            assert any(REPORTED_LIKELIHOOD[v][band] in event.text for v in verbs[event.kind]), (
                event.text
            )
