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
    used_limits = limits or Limits()
    named = {b.contract.name: b for b in behaviours}
    if len(named) < len(behaviours):
        names = [b.contract.name for b in behaviours]
        twice = next(n for n in names if names.count(n) > 1)
        raise BehaviourError(f"two behaviours are called '{twice}'", hint="rename one of them")
    for name in sorted(used_limits.isolate - named.keys()):
        raise BehaviourError(
            f"there is no behaviour called '{name}' to isolate",
            expected=f"one of: {', '.join(sorted(named))}",
        )
    relieving = {n: _relieving(b, behaviours) for n, b in named.items()}
    predecessors = {n: [*_providers(b, behaviours), *relieving[n]] for n, b in named.items()}
    try:
        order = list(TopologicalSorter(predecessors).static_order())
    except CycleError as cycle:
        path = " -> ".join(cycle.args[1])
        raise BehaviourError(f"behaviours wait for each other in a circle: {path}") from cycle
    slots = [make_slot(named[name], used_limits) for name in order]
    for slot in slots:
        slot.relieved_by = frozenset(relieving[slot.contract.name])
    return slots


def _relieving(behaviour: Behaviour, behaviours: Sequence[Behaviour]) -> list[str]:
    """Names of the behaviours that relieve one; they must give all that it gives."""
    relieved = behaviour.contract
    finer = [b.contract for b in behaviours if relieved.name in b.contract.relieves]
    for contract in finer:
        for kind in relieved.gives:
            if kind not in contract.gives:
                raise BehaviourError(
                    f"behaviour '{contract.name}' relieves '{relieved.name}', but does not give '{kind}'",
                    hint=f"let it give '{kind}' too, or leave '{relieved.name}' at work",
                )
    return [c.name for c in finer]


def _providers(behaviour: Behaviour, behaviours: Sequence[Behaviour]) -> list[str]:
    """Names of the other behaviours that give what one needs."""
    contract = behaviour.contract
    others = [b.contract for b in behaviours if b is not behaviour]
    given_kinds = {kind for c in others for kind in c.gives}
    for kind in contract.needs:
        if kind not in given_kinds:
            besides_itself = " but itself" if kind in contract.gives else ""
            raise BehaviourError(
                f"behaviour '{contract.name}' needs '{kind}', which no behaviour{besides_itself} gives",
                expected=f"one of: {', '.join(sorted(given_kinds))}"
                if given_kinds
                else "another behaviour",
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
    read_only_frame = read_only(frame)
    observation = Observation(frame.index, frame.time, frame.size)
    for slot in slots:
        report = slot.run(read_only_frame, observation, directives)
        earlier = observation.reports
        if slot.relieved_by and report.state is ReportState.RAN:
            earlier = tuple(superseded(r, slot) for r in earlier)
        observation = replace(observation, reports=(*earlier, report))
    for slot in slots:
        slot.remember(read_only_frame, observation)
    return observation


def read_only(frame: Frame) -> Frame:
    """The same frame with a read-only image, so that a behaviour that writes to it fails by itself."""
    image = frame.image.view()
    image.flags.writeable = False
    return Frame(frame.index, frame.time, image)
