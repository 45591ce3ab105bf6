"""Loops that are compiled, because they are measured to be hot.

What NumPy does in a dozen passes over an image a compiled loop does in one; what it does in
hundreds of small calls on a few numbers costs next to nothing. Results do not depend on the
number of threads, and sums are taken in the order that is written: no reordering is allowed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

import numba

_uncached: list[str] = []


def cache_note() -> str | None:
    """What the user should know where compiled loops cannot be kept, or None."""
    if not _uncached:
        return None
    return (
        "Hot loops are compiled anew in each run: nowhere may they be kept. "
        "Set NUMBA_CACHE_DIR to a folder that can be written to."
    )


Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Compile a function at its first call, or take what an earlier run compiled.

    Args:
        function: Of arrays and numbers; called with contiguous arrays, for each other layout of
            its arguments is compiled anew.

    Returns:
        The same function; other threads go on while it runs.
    """
    try:
        return cast(Function, numba.njit(cache=True, nogil=True)(function))
    except (
        RuntimeError
    ):  # neither beside the code nor in the user's folders may anything be written
        return cast(Function, _compiled_by_another(function))


def _compiled_by_another(function: Callable[..., object]) -> object:
    """What whoever installed visup has compiled, and what this user has to compile in each run."""
    dispatcher = numba.njit(nogil=True)(function)
    try:
        # Here, since it relies on what numba does not promise, and few users need it.
        from visup.installed_loops import read_installed

        read_installed(dispatcher, function, lambda: _uncached.append(function.__name__))
    except (ImportError, RuntimeError):  # another numba, or they have never run it
        _uncached.append(function.__name__)
    return dispatcher
