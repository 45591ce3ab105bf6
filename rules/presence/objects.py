"""Entering percepts into the mind: regions as objects, health, plug-ins' percepts, unknown kinds.

A new region becomes a tentative object; `reasoner.py` decides whether it is an object at all, or a known one
that reappears. Objects out of view are forgotten here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Percept, Presence, Region
from visup.agent.model.fast_replace import replace
from visup.rules.presence.association import OWNERS, associate, delete_objects

KNOWN_KINDS = frozenset({"region", "hypothesis", "depth", "health"})


@dataclass(frozen=True, slots=True)
class ObjectSettings:
    """Bounds of memory.

    Attributes:
        most_objects: Most remembered objects; those unseen for longest are dropped first.
        most_owners: Most remembered region ids.
        forget_unconfirmed_s: How long an unseen tentative object is remembered, seconds.
        forget_left_s: How long an object that left is remembered, seconds.
        forget_hidden_s: How long a hidden object is remembered that is identified or has a role in a task,
            seconds.
        forget_nameless_s: How long any other hidden object is remembered, seconds.
        percept_age_s: Age at which percepts of plug-ins' own kinds expire, seconds.
    """

    most_objects: int = 64
    most_owners: int = 256
    forget_unconfirmed_s: float = 0.5
    forget_left_s: float = 30.0
    forget_hidden_s: float = 300.0
    # Longer than passing occlusions (2.7 and 4.5 s in the missions); with minutes, road scenes fill the mind
    # with everything that ever passed behind something.
    forget_nameless_s: float = 10.0
    percept_age_s: float = 2.0


@dataclass(frozen=True, slots=True)
class ObjectReasoner:
    """Reasoner of the update phase: enters percepts into the mind.

    Without a behaviour that looked for regions in this step, nothing is concluded about objects.
    """

    settings: ObjectSettings = ObjectSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Enter one observation; see `Reasoner`."""
        mind = replace(
            mind,
            time=observation.time,
            frame_index=observation.frame_index,
            frame_size=observation.frame_size,
            unknown=observation.unknown,
            percepts=self._fresh(mind.percepts, observation),
        )
        for health in observation.of("health"):
            mind = replace(mind, health=health)
        if observation.observed("region"):
            mind = self._see(mind, observation)
        return Outcome(self._forget(mind))

    def _see(self, mind: Mind, observation: Observation) -> Mind:
        found, owners = associate(mind, observation)
        beliefs = [_sighted(mind, i, region) for i, region in found.items()]
        newest = list(owners.items())[-self.settings.most_owners :]
        return mind.with_objects(*beliefs).remember(OWNERS, MappingProxyType(dict(newest)))

    def _fresh(
        self, known: Mapping[str, tuple[Percept, ...]], observation: Observation
    ) -> Mapping[str, tuple[Percept, ...]]:
        oldest = observation.time - self.settings.percept_age_s
        fresh = {
            k: kept for k, ps in known.items() if (kept := tuple(p for p in ps if p.time >= oldest))
        }
        new: dict[str, list[Percept]] = {}
        for report in observation.reports:
            for p in report.percepts:
                if p.kind not in KNOWN_KINDS:
                    new.setdefault(p.kind, []).append(p)
        return MappingProxyType({**fresh, **{k: tuple(ps) for k, ps in new.items()}})

    def _forget(self, mind: Mind) -> Mind:
        parts = {b.object_id for task in mind.tasks for b in task.bindings}
        gone = {i for i, b in mind.objects.items() if self._stale(b, mind, i in parts)}
        left = [b for i, b in mind.objects.items() if i not in gone]
        left.sort(key=lambda b: (b.confirmed, b.last_seen, b.id))
        gone |= {b.id for b in left[: max(0, len(left) - self.settings.most_objects)]}
        return delete_objects(mind, frozenset(gone))

    def _stale(self, belief: ObjectBelief, mind: Mind, is_actor: bool) -> bool:
        unseen = mind.time - belief.last_seen
        if not belief.confirmed:
            return unseen > self.settings.forget_unconfirmed_s
        if belief.presence is Presence.LEFT:
            return unseen > self.settings.forget_left_s
        if belief.presence is not Presence.HIDDEN:
            return False
        known = is_actor or belief.id in mind.answers or _is_identified(belief)
        longest = self.settings.forget_hidden_s if known else self.settings.forget_nameless_s
        return unseen > longest


def _is_identified(belief: ObjectBelief) -> bool:
    """Whether some model is more likely than its being none of the models."""
    return bool(belief.candidates) and belief.candidates[0].confidence > belief.unknown


def _sighted(mind: Mind, object_id: int, region: Region) -> ObjectBelief:
    """The belief about an object after a sighting; the first one initiates it."""
    old, now = mind.objects.get(object_id), mind.time
    if old is None:
        return ObjectBelief(object_id, region, Presence.SEEN, first_seen=now, last_seen=now)
    return replace(old, region=region, last_seen=now)
