"""The first phase of a step: runs all behaviours on the frame, with fault containment.

The output of a behaviour that raises, hangs or breaks its contract is unavailable; its report says why.
`behaviour_slot.py` runs one behaviour, `limits.py` has the policy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.limits import Limits
from visup.agent.execution.behaviour_slot import BehaviourSlot, make_slot, superseded
from visup.agent.model.errors import BehaviourError
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, ReportState


def ordered_slots(
    behaviours: Sequence[Behaviour], limits: Limits | None = None
) -> list[BehaviourSlot]:
    """Slots of behaviours in topological order: each after those that give what it needs.

    Args:
        behaviours: In any order.
        limits: Their limits; the defaults if omitted.

    Raises:
        BehaviourError: Two have the same name, a need is given by none or only in a cycle, or a name to
            isolate is not among them.
    """
    held = limits or Limits()
    named = {b.contract.name: b for b in behaviours}
    if len(named) < len(behaviours):
        names = [b.contract.name for b in behaviours]
        twice = next(n for n in names if names.count(n) > 1)
        raise BehaviourError(f"two behaviours are called '{twice}'", hint="rename one of them")
    for name in sorted(held.isolate - named.keys()):
        raise BehaviourError(
            f"there is no behaviour called '{name}' to isolate",
            expected=f"one of: {', '.join(sorted(named))}",
        )
    closer = {n: _closer(b, behaviours) for n, b in named.items()}
    before = {n: [*_providers(b, behaviours), *closer[n]] for n, b in named.items()}
    try:
        order = list(TopologicalSorter(before).static_order())
    except CycleError as circle:
        path = " -> ".join(circle.args[1])
        raise BehaviourError(f"behaviours wait for each other in a circle: {path}") from circle
    slots = [make_slot(named[name], held) for name in order]
    for slot in slots:
        slot.relieved_by = frozenset(closer[slot.contract.name])
    return slots


def _closer(behaviour: Behaviour, behaviours: Sequence[Behaviour]) -> list[str]:
    """Names of the behaviours that relieve one; they must give all that it gives."""
    coarse = behaviour.contract
    fine = [b.contract for b in behaviours if coarse.name in b.contract.relieves]
    for contract in fine:
        for kind in coarse.gives:
            if kind not in contract.gives:
                raise BehaviourError(
                    f"behaviour '{contract.name}' relieves '{coarse.name}', but does not give '{kind}'",
                    hint=f"let it give '{kind}' too, or leave '{coarse.name}' at work",
                )
    return [c.name for c in fine]


def _providers(behaviour: Behaviour, behaviours: Sequence[Behaviour]) -> list[str]:
    """Names of the other behaviours that give what one needs."""
    contract = behaviour.contract
    others = [b.contract for b in behaviours if b is not behaviour]
    given = {kind for c in others for kind in c.gives}
    for kind in contract.needs:
        if kind not in given:
            alone = " but itself" if kind in contract.gives else ""
            raise BehaviourError(
                f"behaviour '{contract.name}' needs '{kind}', which no behaviour{alone} gives",
                expected=f"one of: {', '.join(sorted(given))}" if given else "another behaviour",
            )
    return [c.name for c in others if set(contract.needs) & set(c.gives)]


def perceive(
    slots: Sequence[BehaviourSlot], frame: Frame, directives: Sequence[Directive]
) -> Observation:
    """Run the behaviours on a frame.

    Args:
        slots: From `ordered_slots`.
        frame: The frame.
        directives: Requests of the last step.

    Returns:
        One report for each behaviour, in order.
    """
    shown = read_only(frame)
    observation = Observation(frame.index, frame.time, frame.size)
    for slot in slots:
        report = slot.run(shown, observation, directives)
        earlier = observation.reports
        if slot.relieved_by and report.state is ReportState.RAN:
            earlier = tuple(superseded(r, slot) for r in earlier)
        observation = replace(observation, reports=(*earlier, report))
    for slot in slots:
        slot.remember(shown, observation)
    return observation


def read_only(frame: Frame) -> Frame:
    """The same frame with a read-only image, so that a behaviour that writes to it fails by itself."""
    image = frame.image.view()
    image.flags.writeable = False
    return Frame(frame.index, frame.time, image)
