"""The meaning of each action: when it holds, begins, progresses and ends, and its contrary.

The table `ACTIONS` defines actions by names of relations in the mind. `known_actions` adds the words and
quantities of rules (`vocabulary.py`) and those of installed packages in the entry point group
`visup.actions`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType

from visup.agent.model.errors import TaskError

GROUP = "visup.actions"
ALL_PERCEPTS = frozenset({"region", "hypothesis", "depth", "health", "signal"})
"""Kinds of percept of visup's own behaviours; signals if a source is configured."""


@dataclass(frozen=True, slots=True)
class ActionDefinition:
    """The meaning of an action, in terms of relations between its actors.

    Attributes:
        name: The action, as in a task file.
        holds: The action holds while one of these relations is true.
        arity: How many actors it takes.
        lasts: Whether it lasts until something else begins (`converging`), rather than ending once it has
            held
            long enough (`coupled`).
        hold_s: Seconds for which it must hold to count as done, without a `for`.
        entry: It begins when one of these relations is true; `holds` if empty.
        progress: Further relations that approach it although it does not hold yet.
        contrary: Relations that mean that it fails.
        expects: Further relations that are expected while it is required.
        undoes: Relations that have ended when it holds; one that an earlier stage required ends in its turn.
        text: "are `converging`": predicate of the actors when it holds.
        takes: 'object' or 'zone' for each actor; all objects if empty.
        measures: Dimension of a quantity ('length', 'time', ...); empty for a relation.
        needs: Kinds of percept without which it is never observed.
        about: One clause of description for users.
    """

    name: str
    holds: tuple[str, ...]
    arity: int = 2
    lasts: bool = False
    hold_s: float = 1.0
    entry: tuple[str, ...] = ()
    progress: tuple[str, ...] = ()
    contrary: tuple[str, ...] = ()
    expects: tuple[str, ...] = ()
    undoes: tuple[str, ...] = ()
    text: str = ""
    takes: tuple[str, ...] = ()
    measures: str = ""
    needs: frozenset[str] = frozenset({"region"})
    about: str = ""

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kind of each of its actors: 'object' or 'zone'."""
        return self.takes or ("object",) * self.arity

    @property
    def begins(self) -> tuple[str, ...]:
        """Relations any of which shows that the action has begun."""
        return self.entry or self.holds

    @property
    def helps(self) -> tuple[str, ...]:
        """Relations any of which shows that it holds or approaches."""
        return (*self.holds, *self.progress)


_TABLE = (
    ActionDefinition(
        "converging",
        holds=("converging",),
        lasts=True,
        hold_s=0.6,
        contrary=("diverging",),
        text="converging",
        about="they draw nearer",
    ),
    ActionDefinition(
        "diverging",
        holds=("diverging",),
        lasts=True,
        hold_s=0.6,
        contrary=("converging",),
        text="diverging",
        about="they draw apart",
    ),
    ActionDefinition(
        "keeping_distance",
        holds=("keeping_distance", "moving_together", "coupled"),
        lasts=True,
        hold_s=0.6,
        contrary=("converging", "diverging"),
        text="keeping their distance",
        about="their distance stays, or they move as one",
    ),
    ActionDefinition(
        "moving_together",
        holds=("moving_together",),
        lasts=True,
        hold_s=0.6,
        contrary=("converging", "diverging"),
        text="moving together",
        about="they move as one",
    ),
    ActionDefinition(
        "touching",
        holds=("touching", "coupled"),
        hold_s=0.2,
        progress=("converging",),
        contrary=("diverging",),
        expects=("converging",),
        text="touching",
        about="they touch",
    ),
    ActionDefinition(
        "coupled",
        holds=("coupled",),
        entry=("coupled", "in_contact"),
        progress=("touching", "moving_together", "converging"),
        contrary=("diverging", "decoupled"),
        expects=("converging", "touching", "moving_together"),
        text="coupled",
        about="they are rigidly connected",
    ),
    ActionDefinition(
        "held_by",
        holds=("coupled",),
        entry=("coupled", "in_contact"),
        progress=("touching", "moving_together", "converging"),
        contrary=("diverging", "decoupled"),
        expects=("converging", "touching", "moving_together"),
        text="held",
        about="the second one has it: they are rigidly connected",
    ),
    ActionDefinition(
        "on",
        holds=("on",),
        hold_s=0.5,
        progress=("converging", "touching"),
        contrary=("diverging",),
        expects=("converging", "touching"),
        text="one on the other",
        about="the first one touches the second and stands above it in the image",
    ),
    ActionDefinition(
        "decoupled",
        holds=("decoupled",),
        hold_s=0.2,
        entry=("decoupled", "diverging"),
        progress=("diverging",),
        expects=("diverging", "touching"),
        undoes=("coupled",),
        text="decoupled",
        about="they are known not to be connected",
    ),
    ActionDefinition(
        "apart",
        holds=("apart",),
        hold_s=0.5,
        expects=("diverging",),
        undoes=("touching", "coupled", "on"),
        text="apart",
        about="they are known not to touch",
    ),
    ActionDefinition(
        "present",
        holds=("present",),
        arity=1,
        hold_s=0.5,
        text="present",
        about="it is in the scene, seen or hidden",
    ),
    ActionDefinition(
        "gone",
        holds=("gone",),
        arity=1,
        hold_s=0.5,
        undoes=("present",),
        text="gone",
        about="it has left the scene",
    ),
    ActionDefinition(
        "inside",
        holds=("inside",),
        arity=2,
        hold_s=0.5,
        text="inside",
        takes=("object", "zone"),
        about="its centre is in the zone",
    ),
    ActionDefinition(
        "outside",
        holds=("outside",),
        arity=2,
        hold_s=0.5,
        text="outside",
        takes=("object", "zone"),
        about="nothing of its outline is in the zone",
    ),
)

ACTIONS: Mapping[str, ActionDefinition] = MappingProxyType({m.name: m for m in _TABLE})
"""The built-in actions."""


@lru_cache(maxsize=1)
def known_actions() -> Mapping[str, ActionDefinition]:
    """All available actions by name: `ACTIONS`, the words of rules, those of plug-ins.

    Raises:
        TaskError: A plug-in's action cannot be loaded, or its name is taken.
    """
    from visup.tasks.actions.vocabulary import rule_actions  # heavy import: rules use NumPy

    known: Mapping[str, ActionDefinition] = {**{m.name: m for m in rule_actions()}, **ACTIONS}
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, p.value)):
        known = with_actions(known, [_loaded(point)])
    return MappingProxyType(known)


def with_actions(
    known: Mapping[str, ActionDefinition], more: Iterable[ActionDefinition]
) -> dict[str, ActionDefinition]:
    """Add actions.

    Raises:
        TaskError: The name of one is taken.
    """
    joined = dict(known)
    for meaning in more:
        if meaning.name in joined:
            raise TaskError(f"there is an action called `{meaning.name}` already")
        joined[meaning.name] = meaning
    return joined


def _loaded(point: EntryPoint) -> ActionDefinition:
    try:
        made = point.load()
    except Exception as fault:
        said = f"{type(fault).__name__}: {fault}"
        raise TaskError(
            f"action `{point.name}` cannot be loaded: {said}", where=point.value
        ) from fault
    if not isinstance(made, ActionDefinition):
        expected = f"a `ActionDefinition` (entry point group `{GROUP}`)"
        raise TaskError(f"`{point.name}` is not an action", where=point.value, expected=expected)
    return made


def contradict(a: ActionDefinition, b: ActionDefinition) -> bool:
    """Whether two actions between the same actors can never hold at the same time."""
    return bool(set(a.holds) <= set(b.contrary) or set(b.holds) <= set(a.contrary))
