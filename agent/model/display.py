"""Records show themselves in notebooks and to rich, where what draws them is installed.

The agent draws nothing and imports nothing that does: what draws is found by its name when a record is
first shown.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

DRAWING = "visup.terminal.display"


def _as_rich(record: Any) -> Any:
    return import_module(DRAWING).shown(record)


def _as_html(record: Any) -> str:
    text: str = import_module(DRAWING).html(record)
    return text


def enable_display(*kinds: type) -> None:
    """Let records of some kinds show themselves."""
    for kind in kinds:
        kind.__rich__ = _as_rich  # type: ignore[attr-defined]
        kind._repr_html_ = _as_html  # type: ignore[attr-defined]
