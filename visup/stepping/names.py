"""Known names of a session: stages and rules, even before the first step."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from visup.agent import Mind, Reasoner
from visup.rules.safety.reasoner import RuleReasoner
from visup.stepping.breakpoints import rule_names, stage_names
from visup.tasks.grammar.structure import stage_names as stages_of
from visup.tasks.supervision.supervise import TaskReasoner


@dataclass(frozen=True, slots=True)
class Names:
    """Known names.

    Attributes:
        stages: Stages of all tasks.
        rules: Rules of all reasoners.
    """

    stages: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()


def known_names(mind: Mind, reasoners: Iterable[Reasoner] = ()) -> Names:
    """The known stages and rules.

    Args:
        mind: Provides evaluated ones; none before its first step.
        reasoners: Provide their own, even before the first step.
    """
    stages, rules = list(stage_names(mind)), list(rule_names(mind))
    for each in reasoners:
        if isinstance(each, TaskReasoner):
            stages += [s for task in each.tasks for s in stages_of(task)]
        if isinstance(each, RuleReasoner):
            rules += [rule.name for rule in each.rules]
    return Names(tuple(dict.fromkeys(stages)), tuple(dict.fromkeys(rules)))
