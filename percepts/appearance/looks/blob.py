"""Pixels of the working picture that belong to something."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.pose import Window


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """Pixels of the working picture.

    Attributes:
        window: (left, top, right, bottom), half open.
        mask: (bottom - top, right - left) bool.
    """

    window: Window
    mask: NDArray[np.bool_]

    @property
    def area(self) -> int:
        """Pixels in the mask."""
        return int(np.count_nonzero(self.mask))
