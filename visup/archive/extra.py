"""Libraries of the extra `visup[cluster]`, imported on demand."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from visup.agent.model.errors import ExtraMissingError

EXTRA = "cluster"


def imported(library: str) -> Any:
    """A library of the extra.

    Raises:
        ExtraMissingError: It is not installed.
    """
    try:
        return import_module(library)
    except ImportError as missing:
        raise ExtraMissingError("an archive", EXTRA) from missing
