"""Rich display of records in notebooks and terminals, where the needed libraries are installed.

The agent imports no drawing code: it is looked up by name when a record is first shown.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from visup.agent.model.mind import Mind

DRAWING = "visup.terminal.display"
PICTURES = "visup.report.annotate"


def _as_rich(record: Any) -> Any:
    return import_module(DRAWING).shown(record)


def _as_html(record: Any) -> str:
    text: str = import_module(DRAWING).html(record)
    return text


def enable_display(*kinds: type) -> None:
    """Enable the display of some types of records."""
    for kind in kinds:
        kind.__rich__ = _as_rich  # type: ignore[attr-defined]
        kind._repr_html_ = _as_html  # type: ignore[attr-defined]


def drawn(image: NDArray[np.uint8], mind: Mind) -> NDArray[np.uint8]:
    """A frame with the beliefs drawn over it.

    Args:
        image: (H, W, 3) uint8 BGR.
        mind: The mind after the step of that frame.

    Returns:
        (H, W, 3) uint8 BGR, a new image.
    """
    picture: NDArray[np.uint8] = import_module(PICTURES).annotate(image, mind)
    return picture
