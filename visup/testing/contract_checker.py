"""The contract checker: does a behaviour keep what its contract says, on clips of all sorts?

Give it to your own tests:

    def test_it_keeps_its_contract():
        check_behaviour(Lamp)
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import cast

from pydantic_core import to_json

from visup.agent import Behaviour, Contract, Frame, Percept, ReportState
from visup.agent.contract.limits import Limits
from visup.agent.execution.pipeline import ordered_slots, perceive
from visup.agent.execution.process_runner import origin_of
from visup.agent.model.errors import BehaviourError, VisupError
from visup.agent.plugins.factory import as_behaviour
from visup.agent.storage.codec import UnsupportedTypeError, encode_percept
from visup.rules.activation.activation import activation_rules
from visup.testing.clips import CLIPS, LabelledFrame
from visup.testing.scripted import Script, stub_behaviours

Make = Callable[[], Behaviour]


@dataclass(frozen=True, slots=True)
class CheckResult:
    """What one check found.

    Attributes:
        check: What was looked at.
        passed: Whether it is as it should be.
        detail: What was found, one line.
    """

    check: str
    passed: bool
    detail: str = ""


@dataclass(slots=True)
class _ClipRun:
    """One run over a clip."""

    percepts: list[Percept] = field(default_factory=list)
    packed: list[bytes] = field(default_factory=list)
    times_ms: list[float] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    wrote: bool = False


def check_behaviour(
    behaviour: Behaviour | Make,
    *,
    clips: Mapping[str, Sequence[LabelledFrame]] | None = None,
    provide: Mapping[str, Script] | None = None,
) -> None:
    """Fail, as a test does, unless a behaviour keeps its contract.

    Args:
        behaviour: Its class, a function that makes one, or one that has not run yet.
        clips: Clips to run it on besides `CLIPS`.
        provide: What is said of a frame of kinds that it needs and clips know nothing of:
            kind -> function of the frame.

    Raises:
        AssertionError: It does not; the message lists every check that failed.
    """
    failed = [f for f in check_results(behaviour, clips=clips, provide=provide) if not f.passed]
    if failed:
        raise AssertionError("\n".join(f"{f.check}: {f.detail}" for f in failed))


def check_results(
    behaviour: Behaviour | Make,
    *,
    clips: Mapping[str, Sequence[LabelledFrame]] | None = None,
    provide: Mapping[str, Script] | None = None,
) -> list[CheckResult]:
    """What every check found; see `check_behaviour`."""
    make = _maker(behaviour)
    try:
        first = as_behaviour(make(), "the behaviour")
        shots = {name: clip() for name, clip in CLIPS.items()} | dict(clips or {})
        stub_behaviours(first.contract.needs, [], provide)
    except VisupError as fault:
        return [CheckResult("it can be plugged in", False, str(fault))]
    found = [CheckResult("it can be plugged in", True, _declared(first.contract))]
    outings = {}
    for name, clip in shots.items():
        outings[name] = _run_clip(make, clip, provide)
        errors = outings[name].errors
        found.append(CheckResult(f"runs on {name}", not errors, errors[0] if errors else ""))
    found += _contract_results(first.contract, make, shots, outings, provide)
    return found


def _contract_results(
    contract: Contract,
    make: Make,
    shots: Mapping[str, Sequence[LabelledFrame]],
    outings: Mapping[str, _ClipRun],
    provide: Mapping[str, Script] | None,
) -> Iterator[CheckResult]:
    percepts = [p for outing in outings.values() for p in outing.percepts]
    kinds = sorted({p.kind for p in percepts})
    told = f"{len(percepts)} percepts: {', '.join(kinds)}" if kinds else "nothing, on any clip"
    yield CheckResult("what it reported", True, told)
    wrote = [name for name, outing in outings.items() if outing.wrote]
    yield CheckResult(
        "leaves frames as they are", not wrote, f"it wrote to {wrote}" if wrote else ""
    )
    changed = [name for name, o in outings.items() if o.packed != _packed(o.percepts)]
    said = f"percepts of earlier frames changed later, on {changed}: report copies"
    yield CheckResult("leaves what it reported as it is", not changed, said if changed else "")
    if contract.deterministic:
        differs = [
            name
            for name in shots
            if _run_clip(make, shots[name], provide).packed != outings[name].packed
        ]
        said = f"a second run reported something else on {differs}; or declare deterministic=False"
        yield CheckResult("is deterministic", not differs, said if differs else "")
    if contract.cost_ms is not None:
        taken = max(median(o.times_ms) for o in outings.values() if o.times_ms)
        said = f"{taken:.3g} ms a run, declared are {contract.cost_ms:g} ms"
        yield CheckResult("keeps its budget", taken <= contract.cost_ms, said)
    if contract.isolate:
        yield _sendable(make)
    if contract.awake:
        yield _wakes(contract)


def _wakes(contract: Contract) -> CheckResult:
    said = "says when it is awake"
    try:
        activation_rules([contract])
    except BehaviourError as fault:
        return CheckResult(said, False, str(fault))
    return CheckResult(said, True, contract.awake)


def _sendable(make: Make) -> CheckResult:
    behaviour = make()
    try:
        origin_of(behaviour, behaviour.contract)
    except BehaviourError as fault:
        return CheckResult("can be sent to a process of its own", False, str(fault))
    return CheckResult("can be sent to a process of its own", True)


def _run_clip(
    make: Make, shots: Sequence[LabelledFrame], provide: Mapping[str, Script] | None
) -> _ClipRun:
    """Run a fresh behaviour over a clip, here and without limits of time."""
    outing, behaviour = _ClipRun(), make()
    own = behaviour.contract.name
    others = stub_behaviours(behaviour.contract.needs, shots, provide)
    here = Limits(hang_s=None, in_process=True, never_asleep=frozenset({own}))
    slots = ordered_slots([*others, behaviour], here)
    for shot in shots:
        image = shot.frame.image.copy()
        frame = Frame(shot.frame.index, shot.frame.time, image)
        seen = perceive(slots, frame, ())
        outing.wrote |= bool((image != shot.frame.image).any())
        report = next(r for r in seen.reports if r.behaviour == own)
        if report.state is ReportState.RAN:
            outing.times_ms.append(report.elapsed_ms)
            outing.percepts += report.percepts
            outing.packed += _packed(report.percepts)
        elif report.state is ReportState.FAILED:
            outing.errors.append(f"frame {frame.index}: {report.error}")
    return outing


def _packed(percepts: Sequence[Percept]) -> list[bytes]:
    return [_bytes(p) for p in percepts]


def _bytes(percept: Percept) -> bytes:
    try:
        packed: bytes = to_json(encode_percept(percept), inf_nan_mode="constants")
        return packed
    except (UnsupportedTypeError, ValueError):
        return repr(percept).encode()


def _maker(behaviour: Behaviour | Make) -> Make:
    if isinstance(behaviour, type) or not hasattr(behaviour, "contract"):
        return cast(Make, behaviour)  # a class or a function makes one
    return lambda: cast(Behaviour, copy.deepcopy(behaviour))


def _declared(c: Contract) -> str:
    needs = f", needs {', '.join(c.needs)}" if c.needs else ""
    return f"{c.name} gives {', '.join(c.gives)}{needs}"
