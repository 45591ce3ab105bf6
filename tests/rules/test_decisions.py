"""A reasoner that does not decide names a condition that is not met; one that decides names none."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import think
from tests.rules.scenes import box_region, seen
from visup.agent import Event, Mind, Observation, Outcome, Presence, Reasoner
from visup.rules.coupling.reasoner import CouplingReasoner
from visup.rules.identity.identification import IdentityReasoner
from visup.rules.presence.lifecycle import TRANSITIONS, state_of
from visup.rules.presence.object_tracks import presence_memory
from visup.rules.presence.reasoner import PresenceReasoner
from visup.rules.reasoners import default_reasoners
from visup.rules.wording.conditions import Subject

EXPLAINING = (PresenceReasoner, IdentityReasoner, CouplingReasoner)
DECISION_OF = {"noticed": "entry", "lost": "loss", "found": "reappearance"}
"""What was decided where an event is not called so."""


@dataclass
class Checked:
    """A reasoner whose explanations are compared with what it does; it counts decisions of each kind."""

    reasoner: PresenceReasoner | IdentityReasoner | CouplingReasoner
    made: set[str]

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        outcome = self.reasoner(mind, observation)
        log = self.reasoner.explain(mind, observation)
        explained = {about for about, conditions in log.items() if all(c.met for c in conditions)}
        assert explained == {decided(e, mind) for e in outcome.events}
        assert all(c.line() for conditions in log.values() for c in conditions)
        self.made |= {kind for kind, _ in explained}
        return outcome


def decided(event: Event, before: Mind) -> Subject:
    """What an event reports; what left and enters again has reappeared."""
    known = before.objects.get(event.objects[0])
    if event.kind == "entry" and known is not None and known.presence is Presence.LEFT:
        return "reappearance", event.objects
    return DECISION_OF.get(event.kind, event.kind), event.objects


def checked_run(observations: Iterable[Observation]) -> set[str]:
    """The kinds of decision that were made, each step of each reasoner having been checked."""
    rules, made = default_reasoners(), set[str]()

    def checked(reasoner: Reasoner) -> Reasoner:
        return Checked(reasoner, made) if isinstance(reasoner, EXPLAINING) else reasoner

    before: dict[int, object] = {}
    for thought in think((*rules.update, *map(checked, rules.cogitate)), observations):
        tracks = presence_memory(thought.mind).tracks
        after = {i: state_of(b, tracks.get(i)) for i, b in thought.mind.objects.items()}
        steps = {(before[i], state) for i, state in after.items() if i in before}
        assert {(a, b) for a, b in steps if a is not b} <= TRANSITIONS
        before = dict(after)
    return made


def crossing(frames: int) -> Iterator[Observation]:
    """One rests, one passes before it and leaves, one docks at the first and goes again, one vanishes."""
    names = {1: [("hubble", 0.9)], 3: [("arm", 0.8), ("hubble", 0.5)]}
    for i in range(frames):
        left = -220 + 6 * (i - 25)
        covered = i >= 25 and left < 300 and left + 200 > 200
        docking = 420 - 0.6 * min(i - 60, 200) + max(0.0, 2.0 * (i - 330)) if i >= 60 else 420
        boxes = [
            None if covered else box_region(1, (200, 150, 100, 80)),
            box_region(2, (left, 100, 200, 200)) if i >= 25 else None,
            box_region(3, (max(docking, 300), 155, 60, 60)) if i >= 60 else None,
            box_region(4, (50, 380, 70, 60)) if i < 40 or i > 140 else None,
        ]
        yield seen(i, boxes, names=names)


def test_reasoners_name_what_is_missing_exactly_when_they_do_not_decide() -> None:
    made = checked_run(crossing(480))
    assert made >= {"entry", "exit", "occlusion", "reappearance", "loss", "identified", "coupled"}


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 4))
def test_they_do_so_whatever_is_seen(seed: int, count: int) -> None:
    import numpy as np

    random = np.random.default_rng(seed)
    start = random.uniform((0, 0, 20, 20), (600, 440, 160, 160), (count, 4))
    pace = random.normal(0.0, 4.0, (count, 2))
    gone = random.integers(0, 60, (count, 2))

    def observations() -> Iterator[Observation]:
        for i in range(75):
            boxes = []
            for k, (x, y, w, h) in enumerate(start):
                hidden = gone[k, 0] <= i < gone[k, 1]
                rect = (x + i * pace[k, 0], y + i * pace[k, 1], w, h)
                # After it was hidden the segmenter gives it another id.
                region = k + 1 + 10 * int(i >= gone[k, 1] > gone[k, 0])
                boxes.append(None if hidden else box_region(region, rect))
            yield seen(i, boxes, names={k + 1: [("arm", 0.7)] for k in range(count)})

    checked_run(observations())
