"""Loops that are compiled, because they are measured to be hot.

What NumPy does in a dozen passes over an image a compiled loop does in one; what it does in
hundreds of small calls on a few numbers costs next to nothing. Results do not depend on the
number of threads, and sums are taken in the order that is written: no reordering is allowed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache

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


def _compiled_by_another(function: Callable[..., object]) -> Any:
    """What whoever installed visup has compiled, and what this user has to compile in each run."""
    dispatcher: Any = numba.njit(nogil=True)(function)
    try:
        dispatcher._cache = _InstalledCache(function)  # type: ignore[no-untyped-call]
    except RuntimeError:  # they have never run it
        _uncached.append(function.__name__)
    return dispatcher


_beside_the_code = next(
    c for c in CompileResultCacheImpl._locator_classes if "InTree" in c.__name__
)


class _ReadableFolder(_beside_the_code):  # type: ignore[misc, valid-type]
    """Finds compiled loops beside the code, where nothing need be written."""

    def ensure_cache_path(self) -> None:
        if not Path(self.get_cache_path()).is_dir():
            raise FileNotFoundError(self.get_cache_path())


class _InstalledImpl(CompileResultCacheImpl):
    _locator_classes = [_ReadableFolder]  # noqa: RUF012


class _InstalledCache(FunctionCache):
    """Compiled loops that are read and never written."""

    _impl_class = _InstalledImpl

    def load_overload(self, sig: Any, target_context: Any) -> object:
        try:
            found: object = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except PermissionError:
            found = None
        if found is None:
            _uncached.append(self._py_func.__name__)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Nothing: it could not be written."""
