"""The contract of a behaviour: what it declares about itself, validated when it is created."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

from visup.agent.model.errors import BehaviourError
from visup.agent.model.records import Frame, Percept

CONTRACT_VERSION = 1
"""Version of the contract; raised when plug-ins written for an older one would no longer run."""

COMPILING_HANG_S = 600.0
"""`hang_s` of behaviours that compile loops in their first runs, which takes minutes on a busy machine."""

MAX_HISTORY = 64
"""Limit on `history`, since past frames are complete images held in memory."""


@dataclass(frozen=True, slots=True)
class Contract:
    """What a behaviour declares about itself.

    Attributes:
        name: Its name, unique within an agent.
        gives: Kinds of percept that it may report.
        needs: Kinds of percept that must have been observed before it runs in a step.
        every_s: Least time between two runs, seconds of video; 0 for every frame.
        cost_ms: Time budget of one run, milliseconds; None to state none.
        hang_s: Seconds after which one run counts as hanging (on recordings; live sources have a shorter
            limit); None for the agent's limit. For behaviours that compile or load something at first use.
        history: Number of past frames, with their percepts, that it wants in `observation.past`.
        deterministic: Whether the same frames give the same percepts.
        isolate: Whether it runs in its own process, with hard limits.
        memory_mb: Memory limit, megabytes; None for the default.
        most_percepts: Most percepts that one run may report.
        version: Version of the contract that it was written for.
        awake: When it is awake: a condition of the rule language about one object `a`, such as
            "expected(a)" or "exists b: gap(a, b) < 60 px"; it runs on frames that follow a step in
            which that held for some object, named by 'wake' directives. Empty for always.
        relieves: Names of coarser behaviours that rest while this one runs in their place; if it
            fails, they take over again.

    Raises:
        BehaviourError: A field is invalid.
    """

    name: str
    gives: tuple[str, ...]
    needs: tuple[str, ...] = ()
    every_s: float = 0.0
    cost_ms: float | None = None
    hang_s: float | None = None
    history: int = 0
    deterministic: bool = True
    isolate: bool = False
    memory_mb: float | None = None
    most_percepts: int = 1000
    version: int = CONTRACT_VERSION
    awake: str = ""
    relieves: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier():
            raise BehaviourError(
                f"{self.name!r} is not a valid name for a behaviour",
                where="contract",
                expected="a word of letters, digits and underscores, such as 'lamp'",
            )
        self._expect(
            "version", self.version == CONTRACT_VERSION, f"{CONTRACT_VERSION}", _OTHER_VERSION
        )
        for field in ("gives", "needs", "relieves"):
            kinds = getattr(self, field)
            object.__setattr__(self, field, tuple(kinds) if isinstance(kinds, list) else kinds)
            self._expect_kinds(field)
        self._expect("gives", bool(self.gives), "at least one kind of percept")
        self._expect("awake", isinstance(self.awake, str), 'a condition, such as "expected(a)"')
        self._expect("relieves", self.name not in self.relieves, "names of other behaviours")
        self._expect("every_s", _is_number_from(self.every_s, 0.0), "seconds, 0 for every frame")
        for field in ("cost_ms", "hang_s", "memory_mb"):
            value = getattr(self, field)
            valid = value is None or (_is_number_from(value, 0.0) and value > 0)
            self._expect(field, valid, "a number above 0, or None")
        self._expect("history", _is_integer_in(self.history, 0, MAX_HISTORY), f"0 to {MAX_HISTORY}")
        self._expect("most_percepts", _is_integer_in(self.most_percepts, 1, 10**6), "1 to 1000000")
        for field in ("deterministic", "isolate"):
            self._expect(field, isinstance(getattr(self, field), bool), "True or False")

    def percept(
        self, frame: Frame, value: Any, *, kind: str | None = None, confidence: float = 1.0
    ) -> Percept:
        """A percept of this behaviour about a frame.

        Args:
            frame: The frame it is about.
            value: The value of the percept.
            kind: Its kind; by default the first in `gives`.
            confidence: 0 to 1.
        """
        return Percept(kind or self.gives[0], value, frame.time, self.name, confidence)

    def _expect_kinds(self, field: str) -> None:
        kinds = getattr(self, field)
        valid = isinstance(kinds, tuple) and all(isinstance(k, str) and k for k in kinds)
        hint = (
            f"a tuple of one has a comma: {field}=({kinds!r},)" if isinstance(kinds, str) else None
        )
        self._expect(field, valid, "a tuple of words, such as ('region',)", hint)
        self._expect(field, len(set(kinds)) == len(kinds), "each kind once")

    def _expect(self, field: str, valid: bool, expected: str, hint: str | None = None) -> None:
        if not valid:
            raise BehaviourError(
                f"`{field}` is {getattr(self, field)!r}",
                where=f"contract of '{self.name}'",
                expected=expected,
                hint=hint,
            )


_OTHER_VERSION = "this behaviour was written for another version of visup; see docs/plugins.md"


def _is_number_from(value: object, least: float) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and isfinite(value) and value >= least  # type: ignore[arg-type, operator]


def _is_integer_in(value: object, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most
