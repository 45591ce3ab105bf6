"""The first phase of a step: the behaviours run on the frame, each contained.

A behaviour that raises or breaks its contract never reaches the mind: its report says so, and what
it gives is unobserved in that step. After three failures in a row it is suspended for a while,
twice as long each time, so that a broken plug-in costs little and can still come back.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

from visup.agent.behaviour import Behaviour
from visup.agent.errors import BehaviourError
from visup.agent.records import Directive, Frame, Observation, Percept, Region, Report, ReportState

PATIENCE = 3
FIRST_SUSPENSION_S = 1.0
LONGEST_SUSPENSION_S = 60.0


_SETTLED = frozenset({"behaviour"})
"""What of a slot is settled when the agent is made; all else is conduct."""


@dataclass(slots=True)
class Slot:
    """A behaviour in its place in an agent, with what the agent knows of its conduct."""

    behaviour: Behaviour
    last_run: float = float("-inf")
    failures: int = 0
    suspended_until: float = float("-inf")

    def conduct(self) -> dict[str, Any]:
        """What the agent knows of its behaviour's conduct, as plain values."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _SETTLED}

    def take_up(self, conduct: Mapping[str, Any]) -> None:
        """Go on from the conduct that another slot told."""
        for name, value in conduct.items():
            setattr(self, name, value)

    @property
    def suspension_s(self) -> float:
        """How long it rests after its latest failure, seconds."""
        over = self.failures - PATIENCE
        return 0.0 if over < 0 else min(FIRST_SUSPENSION_S * 2.0**over, LONGEST_SUSPENSION_S)


def in_order(behaviours: Sequence[Behaviour]) -> list[Slot]:
    """Behaviours so that each comes after those that give what it needs.

    Args:
        behaviours: In any order.

    Raises:
        BehaviourError: Two have one name, or a need is given by none or only in a circle.
    """
    named = {b.contract.name: b for b in behaviours}
    if len(named) < len(behaviours):
        names = [b.contract.name for b in behaviours]
        twice = next(n for n in names if names.count(n) > 1)
        raise BehaviourError(f"two behaviours are called '{twice}'", hint="rename one of them")
    sorter = TopologicalSorter({n: _providers(b, behaviours) for n, b in named.items()})
    try:
        return [Slot(named[name]) for name in sorter.static_order()]
    except CycleError as circle:
        path = " -> ".join(circle.args[1])
        raise BehaviourError(f"behaviours wait for each other in a circle: {path}") from circle


def _providers(behaviour: Behaviour, behaviours: Sequence[Behaviour]) -> list[str]:
    """Names of the others that give what one needs."""
    needs = set(behaviour.contract.needs)
    for kind in sorted(needs - {k for b in behaviours for k in b.contract.gives}):
        given = sorted({k for b in behaviours for k in b.contract.gives})
        raise BehaviourError(
            f"behaviour '{behaviour.contract.name}' needs '{kind}', which no behaviour gives",
            expected=f"one of: {', '.join(given)}",
        )
    others = (b.contract for b in behaviours if b is not behaviour)
    return [c.name for c in others if needs & set(c.gives)]


def perceive(slots: Sequence[Slot], frame: Frame, directives: Sequence[Directive]) -> Observation:
    """Run the behaviours on a frame.

    Args:
        slots: From `in_order`.
        frame: The frame.
        directives: What the last step asked for.

    Returns:
        One report for each behaviour, in order.
    """
    seen = Observation(frame.index, frame.time, frame.size)
    for slot in slots:
        report = _run(slot, frame, seen, directives)
        seen = replace(seen, reports=(*seen.reports, report))
    return seen


def _run(slot: Slot, frame: Frame, seen: Observation, directives: Sequence[Directive]) -> Report:
    contract = slot.behaviour.contract
    idle = Report(contract.name, ReportState.RESTED, contract.gives)
    if frame.time < slot.suspended_until:
        return replace(idle, state=ReportState.SUSPENDED, error="suspended after repeated failures")
    if frame.time - slot.last_run < contract.every_s:
        return idle
    unseen = [k for k in contract.needs if not seen.observed(k)]
    if unseen:
        return replace(idle, error=f"'{unseen[0]}' was not observed")
    slot.last_run = frame.time
    begin = time.perf_counter()
    try:
        percepts = tuple(slot.behaviour.perceive(frame, seen, directives))
        _check(slot.behaviour, percepts, frame.size)
    except Exception as fault:
        # Containment: whatever a plug-in raises is its own failure, never the supervisor's.
        slot.failures += 1
        if slot.failures >= PATIENCE:
            slot.suspended_until = frame.time + slot.suspension_s
        said = f"{type(fault).__name__}: {fault}"
        return replace(idle, state=ReportState.FAILED, error=said, elapsed_ms=_ms(begin))
    slot.failures = 0
    return replace(idle, state=ReportState.RAN, percepts=percepts, elapsed_ms=_ms(begin))


def _check(behaviour: Behaviour, percepts: Sequence[Percept], size: tuple[int, int]) -> None:
    contract = behaviour.contract
    for percept in percepts:
        if not isinstance(percept, Percept):
            raise BehaviourError(
                f"behaviour '{contract.name}' reported a {type(percept).__name__}",
                expected="a Percept",
            )
        if percept.kind not in contract.gives:
            raise BehaviourError(
                f"behaviour '{contract.name}' reported '{percept.kind}'",
                expected=f"one of its contract's kinds: {', '.join(contract.gives)}",
            )
        if isinstance(percept.value, Region):
            _check_region(percept.value, size)


def _check_region(region: Region, size: tuple[int, int]) -> None:
    x, y, w, h = region.bbox
    inside = x >= 0 and y >= 0 and w > 0 and h > 0 and x + w <= size[0] and y + h <= size[1]
    if not inside or region.mask.shape != (h, w):
        raise BehaviourError(
            f"region {region.id} has box {region.bbox} and a mask of {region.mask.shape}",
            expected=f"a box within {size} and a mask of (height, width) of the box",
        )


def _ms(begin: float) -> float:
    return (time.perf_counter() - begin) * 1000.0
