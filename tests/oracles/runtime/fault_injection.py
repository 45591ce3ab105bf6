"""Behaviours that misbehave: every way in which a plug-in was thought to go wrong, to be injected."""

from __future__ import annotations

import ctypes
import itertools
import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from visup.agent import Contract, Directive, Frame, HealthStatus, Observation, Percept

LEAK_MB = 64
"""Memory that one run of a leaking behaviour keeps: more than what is given back by earlier trials
serves again. Its contract allows `ALLOWED_MB` in all."""
ALLOWED_MB = 32.0
NAP_S = 30.0
"""How long a behaviour sleeps that hangs in a call that nothing interrupts."""

Honest = list[Percept]
Fault = Callable[["FaultyBehaviour", Frame, Honest], Any]


class FaultyBehaviour:
    """A behaviour that reports what is true, except for a while.

    Args:
        contract: Its contract.
        truth: Frame index -> values of the one kind that it gives.
        fault: A key of `FAULTS`.
        at: Index of the frame at which it begins to misbehave.
        lasts: For how many frames.
        pause_s: How long a slow run takes, seconds.
    """

    def __init__(
        self,
        contract: Contract,
        truth: Mapping[int, Sequence[Any]],
        fault: str,
        at: int,
        lasts: int,
        pause_s: float,
    ) -> None:
        self.contract = contract
        self.truth = dict(truth)
        self.fault = fault
        self.span = tuple(range(at, at + lasts))
        self.pause_s = pause_s
        self.kept: list[Any] = []

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Any:
        """What is true of the frame, or what comes of the fault."""
        honest = [self.contract.percept(frame, v) for v in self.truth[frame.index]]
        return FAULTS[self.fault](self, frame, honest) if frame.index in self.span else honest


class _UnreadableError(Exception):
    def __str__(self) -> str:
        raise RuntimeError("not even this can be read")


def _raise(fault: BaseException) -> Fault:
    def misbehave(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
        raise fault

    return misbehave


def _recurse(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    return _recurse(self, frame, honest)


def _spin(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    while True:
        pass


def _sleep(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    time.sleep(NAP_S)
    return honest


def _slow(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    time.sleep(self.pause_s)
    return honest


def _stubborn(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    """Hangs, and swallows whatever asks it to stop, for a while."""
    until = time.monotonic() + 4 * self.pause_s
    while time.monotonic() < until:
        try:
            time.sleep(0.01)
        except BaseException:
            continue
    return honest


def _leak(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    self.kept.append(np.ones(LEAK_MB * 2**20, np.uint8))
    return honest


def _write(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    frame.image[:] = 0
    return honest


def _endless(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    return itertools.cycle(honest or [self.contract.percept(frame, 0.0)])


def _endless_lines(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
    """A generator that never yields."""
    while True:
        yield from ()


def _percepts(change: Callable[[FaultyBehaviour, Frame, Percept], Any]) -> Fault:
    def misbehave(self: FaultyBehaviour, frame: Frame, honest: Honest) -> Any:
        some = honest or [Percept(self.contract.gives[0], 0.0, frame.time, self.contract.name)]
        return [change(self, frame, p) for p in some]

    return misbehave


NUMBERS = ("centroid", "similarity", "depth")
"""What is made not a number, in the kinds that have it."""


def _number(value: float) -> Fault:
    """A number that is none, in whatever kind of value."""

    def change(self: FaultyBehaviour, frame: Frame, p: Percept) -> Percept:
        for name in NUMBERS:
            if hasattr(p.value, name):
                bad: Any = (value, value) if name == "centroid" else value
                return replace(p, value=replace(p.value, **{name: bad}))
        if isinstance(p.value, float):
            return replace(p, value=value)
        return replace(p, confidence=value)

    return _percepts(change)


def _shape(self: FaultyBehaviour, frame: Frame, p: Percept) -> Percept:
    """Wrong shape of a mask, or the wrong type where there is none."""
    if hasattr(p.value, "mask"):
        return replace(p, value=replace(p.value, mask=p.value.mask[:-1]))
    return replace(p, value=np.full((2, 2), np.nan))


def _outside(self: FaultyBehaviour, frame: Frame, p: Percept) -> Percept:
    if hasattr(p.value, "bbox"):
        x, y, w, h = p.value.bbox
        return replace(p, value=replace(p.value, bbox=(x + 10_000, y, w, h)))
    return replace(p, confidence=1e9)


def _unhashable(self: FaultyBehaviour, frame: Frame, p: Percept) -> Percept:
    kind: Any = ["region"]
    return replace(p, kind=kind)


FAULTS: Mapping[str, Fault] = MappingProxyType(
    {
        "exception": _raise(ValueError("no light")),
        "unreadable exception": _raise(_UnreadableError()),
        "exit": _raise(SystemExit(3)),
        "interrupt": _raise(KeyboardInterrupt()),
        "out of memory": _raise(MemoryError()),
        "recursion": _recurse,
        "spin": _spin,
        "sleep": _sleep,
        "slow": _slow,
        "stubborn": _stubborn,
        "memory growth": _leak,
        "writes to the frame": _write,
        "endless answer": _endless,
        "endless silence": _endless_lines,
        "nothing returned": lambda self, frame, honest: None,
        "a number returned": lambda self, frame, honest: 42,
        "no percepts": lambda self, frame, honest: ["region", 1, None],
        "not a number": _number(float("nan")),
        "infinite": _number(float("inf")),
        "wrong shape": _percepts(_shape),
        "outside the image": _percepts(_outside),
        "wrong type": _percepts(lambda self, frame, p: replace(p, value=HealthStatus)),
        "wrong kind": _percepts(lambda self, frame, p: replace(p, kind="verdict")),
        "unhashable kind": _percepts(_unhashable),
        "wrong source": _percepts(lambda self, frame, p: replace(p, source="somebody")),
        "time in the future": _percepts(lambda self, frame, p: replace(p, time=p.time + 60.0)),
        "time going backwards": _percepts(lambda self, frame, p: replace(p, time=p.time - 1.0)),
        "time not a number": _percepts(lambda self, frame, p: replace(p, time=float("nan"))),
        "confidence of two": _percepts(lambda self, frame, p: replace(p, confidence=2.0)),
        "process ended": lambda self, frame, honest: os._exit(3),
        "crash": lambda self, frame, honest: ctypes.string_at(0),
    }
)
"""Kind of fault -> what the behaviour does instead of reporting what is true."""

DEADLY = frozenset({"process ended", "crash"})
"""Nothing within a process survives these: they are injected into isolated behaviours only."""
NAPPING = frozenset({"sleep"})
"""Within the process the thread sleeps on until it wakes; nothing can end it before."""
WAITING = frozenset({"spin", "sleep", "slow", "stubborn", "endless silence"})
"""Faults that cost the behaviour's whole budget."""
