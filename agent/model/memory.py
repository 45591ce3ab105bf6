"""The memory of reasoners from step to step, each under its own typed key."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

Remembered = TypeVar("Remembered")


@dataclass(frozen=True, slots=True, eq=False)
class MemoryKey(Generic[Remembered]):
    """The typed key of one reasoner's memory in a mind, owned by the reasoner.

    `mind.recall(KEY)` returns the memory, `mind.remember(KEY, value)` a mind with the memory `value`.

    Attributes:
        name: Unique among the reasoners of an agent; identifies the memory in checkpoints.
        default: The initial memory; immutable.
    """

    name: str
    default: Remembered
