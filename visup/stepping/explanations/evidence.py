"""Trees of reasons, down to the percepts of frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from visup.agent import Depth, Health, Hypothesis, Observation, Percept, Region
from visup.agent.model.display import enable_display
from visup.rules.safety.explain import RuleExplanation
from visup.wording import prose


@dataclass(frozen=True, slots=True)
class Why:
    """A reason and the reasons for it.

    Attributes:
        text: One clause.
        parts: The reasons for it.
        frame_index: Its frame, or None.
        time: Its time, seconds.
        percept: Its percept, or None.
    """

    text: str
    parts: tuple[Why, ...] = ()
    frame_index: int | None = None
    time: float | None = None
    percept: Percept | None = None

    def lines(self, indent: int = 0) -> Iterator[str]:
        """The tree as indented lines of text."""
        yield "  " * indent + self.line()
        for part in self.parts:
            yield from part.lines(indent + 1)

    def line(self) -> str:
        """This node alone."""
        text = prose(self.text)
        if self.frame_index is None or self.time is None:
            return text
        return f"{text} [frame {self.frame_index}, {self.time:.2f} s]"

    def walk(self) -> Iterator[Why]:
        """This node and all below it."""
        yield self
        for part in self.parts:
            yield from part.walk()

    @property
    def percepts(self) -> tuple[Percept, ...]:
        """All percepts in the tree."""
        return tuple(w.percept for w in self.walk() if w.percept is not None)

    @property
    def regions(self) -> tuple[int | None, tuple[Region, ...]]:
        """The latest frame with regions in the tree, and these regions; (None, ()) without any."""
        found = [
            (w.frame_index, w.percept.value)
            for w in self.walk()
            if w.percept is not None and isinstance(w.percept.value, Region)
        ]
        frame = max((n for n, _ in found if n is not None), default=None)
        return frame, tuple(region for n, region in found if n == frame)

    def __str__(self) -> str:
        return "\n".join(self.lines())


def explanation_tree(explained: RuleExplanation) -> Why:
    """An explanation of the rule language as a tree of reasons."""
    return Why(explained.line(), tuple(explanation_tree(p) for p in explained.parts))


def region_percepts(
    observation: Observation, region_id: int, *, names: bool = False
) -> tuple[Why, ...]:
    """The percepts of a frame about one region.

    Args:
        observation: The observation.
        region_id: The region.
        names: Whether to include percepts about its identity.
    """
    kinds = (Region, Hypothesis, Depth) if names else (Region,)
    return tuple(
        percept_reason(percept, observation)
        for report in observation.reports
        for percept in report.percepts
        if isinstance(percept.value, kinds) and _about(percept.value) == region_id
    )


def _about(value: Region | Hypothesis | Depth) -> int:
    return value.id if isinstance(value, Region) else value.region_id


def percept_reason(percept: Percept, observation: Observation) -> Why:
    """A percept as a leaf of the tree."""
    text = f"{percept.source} reported {percept_text(percept.value)}"
    return Why(text, (), observation.frame_index, observation.time, percept)


def percept_text(value: object) -> str:
    """A percept value in a few words."""
    match value:
        case Region():
            x, y, w, h = value.bbox
            box = f"{w}x{h} at {x},{y}"
            return f"region {value.id}, {box}, confidence {value.confidence:.2f}"
        case Hypothesis():
            view = f"view {value.view} of {value.name}, similarity {value.similarity:.2f}"
            return f"that region {value.region_id} looks like {view}"
        case Depth():
            distance = f"{value.depth:.1f} ± {value.sigma:.1f}"
            return f"that region {value.region_id}, if it is {value.name}, is {distance} model units away"
        case Health():
            return f"camera {value.status.value}" + (f": {value.detail}" if value.detail else "")
        case float():
            return f"{value:.6g}"
    text = str(value)
    return text if len(text) <= 70 else f"{text[:67]}..."


enable_display(Why)
