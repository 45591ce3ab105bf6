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
    serialised: list[bytes] = field(default_factory=list)
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
    failed = [r for r in check_results(behaviour, clips=clips, provide=provide) if not r.passed]
    if failed:
        raise AssertionError("\n".join(f"{r.check}: {r.detail}" for r in failed))


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
        all_clips = {name: clip() for name, clip in CLIPS.items()} | dict(clips or {})
        stub_behaviours(first.contract.needs, [], provide)
    except VisupError as error:
        return [CheckResult("it can be plugged in", False, str(error))]
    results = [CheckResult("it can be plugged in", True, _declared(first.contract))]
    runs = {}
    for name, clip in all_clips.items():
        runs[name] = _run_clip(make, clip, provide)
        errors = runs[name].errors
        results.append(CheckResult(f"runs on {name}", not errors, errors[0] if errors else ""))
    results += _contract_results(first.contract, make, all_clips, runs, provide)
    return results


def _contract_results(
    contract: Contract,
    make: Make,
    clips: Mapping[str, Sequence[LabelledFrame]],
    runs: Mapping[str, _ClipRun],
    provide: Mapping[str, Script] | None,
) -> Iterator[CheckResult]:
    percepts = [p for run in runs.values() for p in run.percepts]
    kinds = sorted({p.kind for p in percepts})
    summary = f"{len(percepts)} percepts: {', '.join(kinds)}" if kinds else "nothing, on any clip"
    yield CheckResult("what it reported", True, summary)
    writers = [name for name, run in runs.items() if run.wrote]
    yield CheckResult(
        "leaves frames as they are", not writers, f"it wrote to {writers}" if writers else ""
    )
    changed = [name for name, o in runs.items() if o.serialised != _serialised(o.percepts)]
    detail = f"percepts of earlier frames changed later, on {changed}: report copies"
    yield CheckResult("leaves what it reported as it is", not changed, detail if changed else "")
    if contract.deterministic:
        differs = [
            name
            for name in clips
            if _run_clip(make, clips[name], provide).serialised != runs[name].serialised
        ]
        detail = (
            f"a second run reported something else on {differs}; or declare deterministic=False"
        )
        yield CheckResult("is deterministic", not differs, detail if differs else "")
    if contract.cost_ms is not None:
        median_ms = max(median(o.times_ms) for o in runs.values() if o.times_ms)
        detail = f"{median_ms:.3g} ms a run, declared are {contract.cost_ms:g} ms"
        yield CheckResult("keeps its budget", median_ms <= contract.cost_ms, detail)
    if contract.isolate:
        yield _isolation_result(make)
    if contract.awake:
        yield _awake_result(contract)


def _awake_result(contract: Contract) -> CheckResult:
    check = "says when it is awake"
    try:
        activation_rules([contract])
    except BehaviourError as error:
        return CheckResult(check, False, str(error))
    return CheckResult(check, True, contract.awake)


def _isolation_result(make: Make) -> CheckResult:
    behaviour = make()
    try:
        origin_of(behaviour, behaviour.contract)
    except BehaviourError as error:
        return CheckResult("can be sent to a process of its own", False, str(error))
    return CheckResult("can be sent to a process of its own", True)


def _run_clip(
    make: Make, clip: Sequence[LabelledFrame], provide: Mapping[str, Script] | None
) -> _ClipRun:
    """Run a fresh behaviour over a clip, here and without limits of time."""
    run, behaviour = _ClipRun(), make()
    name = behaviour.contract.name
    providers = stub_behaviours(behaviour.contract.needs, clip, provide)
    limits = Limits(hang_s=None, in_process=True, never_asleep=frozenset({name}))
    slots = ordered_slots([*providers, behaviour], limits)
    for labelled in clip:
        image = labelled.frame.image.copy()
        frame = Frame(labelled.frame.index, labelled.frame.time, image)
        observation = perceive(slots, frame, ())
        run.wrote |= bool((image != labelled.frame.image).any())
        report = next(r for r in observation.reports if r.behaviour == name)
        if report.state is ReportState.RAN:
            run.times_ms.append(report.elapsed_ms)
            run.percepts += report.percepts
            run.serialised += _serialised(report.percepts)
        elif report.state is ReportState.FAILED:
            run.errors.append(f"frame {frame.index}: {report.error}")
    return run


def _serialised(percepts: Sequence[Percept]) -> list[bytes]:
    return [_percept_bytes(p) for p in percepts]


def _percept_bytes(percept: Percept) -> bytes:
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
