"""Compiled loops of an installation in which this user may not write: read, never written.

Numba keeps what it has compiled beside the code only for users who may write there, so that all others would
compile everything in each run. *Approximation*: this relies on numba's internal classes; with a numba that
has others the import fails, and the loops are compiled in each run, as without it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache

_beside_the_code = next(
    (c for c in CompileResultCacheImpl._locator_classes if "InTree" in c.__name__), None
)
if _beside_the_code is None:
    raise ImportError("numba keeps compiled loops elsewhere than beside the code")


def read_installed(
    dispatcher: Any, function: Callable[..., object], compiled_anew: Callable[[], None]
) -> None:
    """Let a function that numba compiles be read from what another user has compiled.

    Args:
        dispatcher: The function as numba wraps it.
        function: The function itself.
        compiled_anew: Called for each signature that has to be compiled all the same.

    Raises:
        RuntimeError: Nothing was compiled beside the code.
    """
    cache = _InstalledCache(function)  # type: ignore[no-untyped-call]
    cache.compiled_anew = compiled_anew
    dispatcher._cache = cache


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
    compiled_anew: Callable[[], None]

    def load_overload(self, sig: Any, target_context: Any) -> object:
        try:
            found: object = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except PermissionError:
            found = None
        if found is None:
            self.compiled_anew()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Nothing: it could not be written."""
