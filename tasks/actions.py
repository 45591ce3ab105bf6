"""What each action means: when it holds, begins, progresses, is over, and what is its contrary.

All of it stands in one table, `ACTIONS`; a plug-in adds an action by handing a longer mapping to
`task_thinker` and `parse_task`. The words in the table are names of relations in the mind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True, slots=True)
class Meaning:
    """The meaning of an action, in terms of relations between its actors.

    Attributes:
        name: The action, as in a task file.
        holds: The action holds while one of these relations is true.
        arity: How many actors it takes.
        lasts: Whether it goes on until something else is seen to begin (`converging`), rather
            than being over once it has held long enough (`coupled`).
        hold_s: Seconds for which it must have held to count as done, unless `for` says otherwise.
        entry: It is seen to begin when one of these is true; `holds` when empty.
        while_not: A touch does not make it begin while one of these is still true: what draws
            nearer has not met yet, however little lies between in the image.
        progress: Further relations that bring it nearer although it does not hold yet.
        contrary: Relations that say that it fails.
        expects: Further relations that are no reason for worry while it is asked for.
        text: "are `converging`": what is said of the actors when it holds.
    """

    name: str
    holds: tuple[str, ...]
    arity: int = 2
    lasts: bool = False
    hold_s: float = 1.0
    entry: tuple[str, ...] = ()
    while_not: tuple[str, ...] = ()
    progress: tuple[str, ...] = ()
    contrary: tuple[str, ...] = ()
    expects: tuple[str, ...] = ()
    text: str = ""

    @property
    def begins(self) -> tuple[str, ...]:
        """Relations one of which shows that the action has begun."""
        return self.entry or self.holds

    @property
    def helps(self) -> tuple[str, ...]:
        """Relations one of which shows that it holds or comes nearer."""
        return (*self.holds, *self.progress)


_TABLE = (
    Meaning(
        "converging",
        holds=("converging",),
        lasts=True,
        contrary=("diverging",),
        text="converging",
    ),
    Meaning(
        "diverging",
        holds=("diverging",),
        lasts=True,
        contrary=("converging",),
        text="diverging",
    ),
    Meaning(
        "keeping_distance",
        holds=("keeping_distance", "moving_together", "coupled"),
        lasts=True,
        contrary=("converging", "diverging"),
        text="keeping their distance",
    ),
    Meaning(
        "moving_together",
        holds=("moving_together", "coupled"),
        lasts=True,
        contrary=("converging", "diverging"),
        text="moving together",
    ),
    Meaning(
        "touching",
        holds=("touching", "coupled"),
        hold_s=0.2,
        progress=("converging",),
        contrary=("diverging",),
        expects=("converging",),
        text="touching",
    ),
    Meaning(
        "coupled",
        holds=("coupled",),
        entry=("coupled", "touching"),
        while_not=("converging",),
        progress=("touching", "moving_together", "converging"),
        contrary=("diverging", "decoupled"),
        expects=("converging", "touching", "moving_together"),
        text="coupled",
    ),
    Meaning(
        "decoupled",
        holds=("decoupled",),
        hold_s=0.5,
        entry=("decoupled", "diverging"),
        progress=("diverging",),
        expects=("diverging", "touching"),
        text="decoupled",
    ),
    Meaning("apart", holds=("apart",), hold_s=0.5, expects=("diverging",), text="apart"),
    Meaning("present", holds=("present",), arity=1, hold_s=0.5, text="present"),
    Meaning("gone", holds=("gone",), arity=1, hold_s=0.5, text="gone"),
)

ACTIONS: Mapping[str, Meaning] = MappingProxyType({m.name: m for m in _TABLE})
"""The actions that visup knows."""


def contradict(a: Meaning, b: Meaning) -> bool:
    """Whether two actions between the same actors can never hold at the same time."""
    return bool(set(a.holds) <= set(b.contrary) or set(b.holds) <= set(a.contrary))
