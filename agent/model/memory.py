"""The memory of reasoners from step to step, each under its own typed key."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

Remembered = TypeVar("Remembered")


@dataclass(frozen=True, slots=True, eq=False)
class MemoryKey(Generic[Remembered]):
    """The place of one reasoner's memory in a mind; whoever owns the key says what stands there.

    `mind.recall(KEY)` gives what is remembered, `mind.remember(KEY, value)` a mind that remembers `value`.

    Attributes:
        name: Unique among the reasoners of an agent; checkpoints know the memory by it.
        default: What is remembered before anything was; immutable.
    """

    name: str
    default: Remembered
