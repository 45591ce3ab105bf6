"""Samples of plain signals: conversion of times and values, with NaN as unknown."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import SupportsFloat

from visup.agent.model.errors import SettingsError
from visup.rules.formula.units import TICKS
from visup.rules.monitoring.intervals import UNKNOWN, Interval

SignalValue = SupportsFloat | Interval | None
"""A number of Python or NumPy, an interval, or None for unknown."""
Signals = Mapping[str, SignalValue]


def later(time: float, before: int | None) -> int:
    """The time of a sample in microseconds, which must be later than the previous one."""
    try:
        now = round(time * TICKS)
    except (OverflowError, TypeError, ValueError):  # infinite, or not a number
        raise SettingsError(
            f"a sample has the time {time if isinstance(time, SupportsFloat) else repr(time)}",
            expected="seconds, a finite number",
            hint=_LEAVE_OUT,
        ) from None
    if before is not None and now <= before:
        what = f"a sample at {time:.6g} s comes after one at {before / TICKS:.6g} s"
        raise SettingsError(what, expected="times that increase", hint="sort samples by their time")
    return now


_LEAVE_OUT = "leave samples without a time out"


def known_interval(value: SignalValue) -> Interval:
    """The interval of a signal, in Python floats: those of NumPy are slower and warn."""
    if type(value) is float and value == value:  # NaN is not equal to itself
        return (value, value)
    if value is None:
        return UNKNOWN
    try:
        low, high = value if isinstance(value, tuple) else (value, value)
        low, high = float(low), float(high)
    except (OverflowError, TypeError, ValueError):  # too large, a word, an array, three bounds
        raise SettingsError(
            f"a signal is {value!r}",
            expected="a number, an interval of two, or None where nothing is known",
        ) from None
    low, high = -inf if low != low else low, inf if high != high else high
    if low > high:
        what = f"a signal is the interval ({low:g}, {high:g})"
        raise SettingsError(what, expected="the lower bound first")
    return (low, high)
