"""Evaluation of stage conditions: beginning, end, progress and failure of steps as stated by the course."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

from visup.agent import Relation, Truth
from visup.rules.formula.nodes import And, Formula, Not, Or
from visup.rules.formula.truth import NEGATION, conjunction, disjunction
from visup.tasks.automaton.states import TaskStep
from visup.tasks.grammar.conditions import Condition, Lasted
from visup.tasks.grammar.nodes import Action, Comparison, Hold, StageCondition, Task
from visup.tasks.grammar.structure import fact_key
from visup.tasks.grammar.units import value
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.observe import RelationLookup
from visup.tasks.verification.step_monitor import Worked

Holds = Callable[[str, tuple[str, ...]], Truth]
"""Whether an action holds now, by its key and its actors."""


def _passed(since: float, now: float) -> float:
    return now - since


@dataclass(frozen=True)
class ConditionEvaluator:
    """The conditions of a task at one moment.

    Attributes:
        task: The task.
        holds: Whether an action holds now.
        relations: The current relations.
    """

    task: Task
    holds: Holds
    relations: RelationLookup

    def truth(self, condition: Formula, worked: Worked = _passed) -> Truth:
        """Whether a condition holds; unknown when the facts that decide it were not observed."""
        match condition:
            case Action() | Comparison():
                return self.holds(*fact_key(self.task, condition))
            case Not(part=part):
                return NEGATION[self.truth(part, worked)]
            case And(parts=parts):
                return conjunction(self.truth(p, worked) for p in parts)
            case Or(parts=parts):
                return disjunction(self.truth(p, worked) for p in parts)
            case Lasted(part=part):
                return self.relation(
                    cast("Condition", part), Hold(condition.duration), worked
                ).truth
        raise TypeError(f"a task has no condition like {condition}")

    def relation(
        self, condition: Condition, lasting: Hold | None, worked: Worked = _passed
    ) -> Relation:
        """A condition as a relation: true once it has held as long as it must, pauses not counted."""
        found = self.relations.lasting(str(condition), (), self.truth(condition, worked))
        if found.truth is not Truth.TRUE or lasting is None:
            return found
        must = value(self.task.amount(lasting.duration))
        held = worked(found.since, self.relations.time) >= must - 1e-9
        return found if held else replace(found, truth=Truth.FALSE)

    def apply(self, step: TaskStep, seen: ActionObservation) -> ActionObservation:
        """An observation in which conditions of the course override those of the action."""
        worked = partial(seen.elapsed, step)
        for condition in step.conditions:
            seen = self._apply(condition, seen, worked)
        return seen

    def _apply(
        self, condition: StageCondition, seen: ActionObservation, worked: Worked
    ) -> ActionObservation:
        if condition.kind == "pauses":
            return seen
        found = self.relation(condition.condition, condition.lasting, worked)
        known = seen.observed or found.truth is not Truth.UNKNOWN
        true = found if found.truth is Truth.TRUE else None
        match condition.kind:
            case "begins":
                return replace(seen, entry=true, new_trend=None, observed=known)
            case "ends":
                return replace(seen, over=found.truth, observed=known)
            case "progresses":
                helps = seen.helps if seen.holds is Truth.TRUE else true
                return replace(seen, helps=helps, new_trend=None, observed=known)
            case "fails":
                return replace(seen, contrary=true, decisive=True, observed=known)
