"""The reasoners of rules/, in the order in which an agent runs them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from visup.agent import Reasoner
from visup.rules.coupling.coupling import Couple, CouplingSettings
from visup.rules.formula.nodes import Rule
from visup.rules.identity.depth import BelieveDepth, DepthSettings
from visup.rules.identity.questions import Ask, QuestionSettings
from visup.rules.identity.votes import Votes, VoteSettings
from visup.rules.language.parser import shipped_rules
from visup.rules.pose.reasoner import BelievePose, PoseSettings
from visup.rules.presence.association import ObjectSettings, UpdateObjects
from visup.rules.presence.lifecycle import PresenceSettings, SeePresence
from visup.rules.relations.kinematics import RelationSettings
from visup.rules.relations.reasoner import Relations
from visup.rules.relations.zones import SeeZones, ZoneSettings
from visup.rules.safety.reasoner import RuleReasoner
from visup.rules.wording.relation_events import NarrativeSettings, TellRelations


@dataclass(frozen=True, slots=True)
class RuleSettings:
    """Settings of all reasoners of rules/, one group for each."""

    objects: ObjectSettings = field(default_factory=ObjectSettings)
    votes: VoteSettings = field(default_factory=VoteSettings)
    pose: PoseSettings = field(default_factory=PoseSettings)
    questions: QuestionSettings = field(default_factory=QuestionSettings)
    presence: PresenceSettings = field(default_factory=PresenceSettings)
    depth: DepthSettings = field(default_factory=DepthSettings)
    relations: RelationSettings = field(default_factory=RelationSettings)
    zones: ZoneSettings = field(default_factory=ZoneSettings)
    coupling: CouplingSettings = field(default_factory=CouplingSettings)
    narrative: NarrativeSettings = field(default_factory=NarrativeSettings)


@dataclass(frozen=True, slots=True)
class RuleSet:
    """Reasoners by phase, in order.

    Attributes:
        update: Percepts enter the mind.
        cogitate: Presence, votes, questions, poses, depth, relations, zones, couplings, narrative, rules.
    """

    update: tuple[Reasoner, ...]
    cogitate: tuple[Reasoner, ...]


def default_reasoners(
    settings: RuleSettings | None = None, rules: tuple[Rule, ...] | None = None
) -> RuleSet:
    """The reasoners that ship with visup.

    Args:
        settings: Their settings; the defaults when left out.
        rules: Rules to watch; those of `safety.rules` when left out.

    Returns:
        The reasoners of the update and cogitate phases. Each is a pure function of mind and
        observation, so that one set may serve many agents.
    """
    s = settings or RuleSettings()
    return RuleSet(
        update=(UpdateObjects(s.objects),),
        cogitate=(
            SeePresence(s.presence),
            Votes(s.votes),
            Ask(s.questions),
            BelievePose(s.pose),
            BelieveDepth(s.depth),
            Relations(s.relations),
            SeeZones(s.zones),
            Couple(replace(s.coupling, relations=s.relations)),
            TellRelations(s.narrative),
            RuleReasoner(shipped_rules() if rules is None else rules),
        ),
    )
