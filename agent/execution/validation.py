"""Validates the reports of behaviours, so that invalid percepts never reach the mind.

Each check raises a `BehaviourError` with the fault and what was expected.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice

from visup.agent.contract.contract import Contract
from visup.agent.contract.percept_values import (
    brief,
    check_value,
    expect,
    is_finite,
    type_with_article,
)
from visup.agent.model.errors import BehaviourError
from visup.agent.model.records import Frame, Observation, Percept, Region

SAME_TIME_S = 1e-6


def collect_percepts(contract: Contract, returned: object) -> tuple[Percept, ...]:
    """The return value of a behaviour as percepts; an endless generator is cut off.

    Raises:
        BehaviourError: It is not iterable, has other elements, or more than the contract allows.
    """
    if not isinstance(returned, Iterable) or isinstance(returned, str | bytes | Mapping | Percept):
        raise BehaviourError(
            f"behaviour '{contract.name}' returned {type_with_article(returned)}",
            expected="percepts, one after another: yield each, or return a list of them",
            hint="return () when there is nothing to report" if returned is None else None,
        )
    percepts = tuple(islice(returned, contract.most_percepts + 1))
    for percept in percepts:
        if not isinstance(percept, Percept):
            raise BehaviourError(
                f"behaviour '{contract.name}' reported {type_with_article(percept)}",
                expected="a Percept",
            )
    if len(percepts) > contract.most_percepts:
        raise BehaviourError(
            f"behaviour '{contract.name}' reported more than {contract.most_percepts} percepts",
            expected="at most `most_percepts` of its contract in one run",
        )
    return percepts


def check_percepts(
    contract: Contract, percepts: Iterable[Percept], frame: Frame, before: Observation | None = None
) -> None:
    """Check percepts against the contract and their kinds.

    Args:
        contract: Contract of the behaviour.
        percepts: Its percepts.
        frame: The frame.
        before: Reports of earlier behaviours on it: region ids must be unique.

    Raises:
        BehaviourError: One is not valid.
    """
    region_ids: set[int] = {r.id for r in before.of("region")} if before is not None else set()
    for p in percepts:
        subject = f"behaviour '{contract.name}' reported '{brief(p.kind)}'"
        if not isinstance(p.kind, str) or p.kind not in contract.gives:
            expected = f"one of its contract's kinds: {', '.join(contract.gives)}"
            raise BehaviourError(subject, expected=expected)
        expect(
            is_finite(p.time) and abs(p.time - frame.time) <= SAME_TIME_S,
            f"{subject} with time {brief(p.time)}",
            f"the frame's time, {frame.time:g} s",
        )
        expect(
            p.source == contract.name,
            f"{subject} with source {brief(p.source)}",
            f"its own name, '{contract.name}'",
        )
        expect(
            is_finite(p.confidence) and 0.0 <= p.confidence <= 1.0,
            f"{subject} with confidence {brief(p.confidence)}",
            "a number from 0 to 1",
        )
        check_value(p.kind, p.value, frame.size, subject)
        if isinstance(p.value, Region):
            expect(
                p.value.id not in region_ids,
                f"region {p.value.id} comes twice",
                "each id once, also among all behaviours that give regions",
            )
            region_ids.add(p.value.id)
