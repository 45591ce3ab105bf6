"""The reasoners of rules/, in the order in which an agent runs them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from visup.agent import Reasoner
from visup.rules.coupling import CouplingReasoner, CouplingSettings
from visup.rules.formula.nodes import Rule
from visup.rules.identity import (
    DepthReasoner,
    DepthSettings,
    IdentityReasoner,
    QuestionReasoner,
    QuestionSettings,
    VoteSettings,
)
from visup.rules.language.parser import shipped_rules
from visup.rules.pose import PoseReasoner, PoseSettings
from visup.rules.presence import (
    ObjectReasoner,
    ObjectSettings,
    PresenceReasoner,
    PresenceSettings,
)
from visup.rules.relations import RelationReasoner, RelationSettings, ZoneReasoner, ZoneSettings
from visup.rules.safety.reasoner import RuleReasoner
from visup.rules.traits.reasoner import TraitReasoner, TraitSettings
from visup.rules.wording import RelationEventReasoner, RelationEventSettings


@dataclass(frozen=True, slots=True)
class ReasonerSettings:
    """Settings of all reasoners of rules/, one group each."""

    objects: ObjectSettings = field(default_factory=ObjectSettings)
    votes: VoteSettings = field(default_factory=VoteSettings)
    pose: PoseSettings = field(default_factory=PoseSettings)
    questions: QuestionSettings = field(default_factory=QuestionSettings)
    presence: PresenceSettings = field(default_factory=PresenceSettings)
    depth: DepthSettings = field(default_factory=DepthSettings)
    relations: RelationSettings = field(default_factory=RelationSettings)
    traits: TraitSettings = field(default_factory=TraitSettings)
    zones: ZoneSettings = field(default_factory=ZoneSettings)
    coupling: CouplingSettings = field(default_factory=CouplingSettings)
    narrative: RelationEventSettings = field(default_factory=RelationEventSettings)


@dataclass(frozen=True, slots=True)
class ReasonerSet:
    """Reasoners by phase, in order.

    Attributes:
        update: Enters percepts into the mind.
        cogitate: Presence, votes, questions, poses, depth, relations, traits, zones, couplings, narrative,
            rules.
    """

    update: tuple[Reasoner, ...]
    cogitate: tuple[Reasoner, ...]


def default_reasoners(
    settings: ReasonerSettings | None = None,
    rules: tuple[Rule, ...] | None = None,
    *,
    traits: bool = False,
    early: bool = False,
) -> ReasonerSet:
    """The reasoners that ship with visup.

    Args:
        settings: Their settings; defaults when omitted.
        rules: Rules to monitor; those of `safety.rules` when omitted.
        early: Whether verdicts about the future are reported as soon as they are decided.
        traits: Whether colours, sizes and initial positions of objects are remembered.

    Returns:
        The reasoners of the update and cogitate phases. Each is a pure function of mind and
        observation, so one set may serve many agents.
    """
    s = settings or ReasonerSettings()
    return ReasonerSet(
        update=(ObjectReasoner(s.objects),),
        cogitate=(
            PresenceReasoner(s.presence),
            IdentityReasoner(s.votes),
            QuestionReasoner(s.questions),
            PoseReasoner(s.pose),
            DepthReasoner(s.depth),
            RelationReasoner(s.relations),
            *((TraitReasoner(replace(s.traits, relations=s.relations)),) if traits else ()),
            ZoneReasoner(s.zones),
            CouplingReasoner(replace(s.coupling, relations=s.relations)),
            RelationEventReasoner(s.narrative),
            RuleReasoner(shipped_rules() if rules is None else rules, early=early),
        ),
    )
