"""Public ids of regions: each is given once."""

from __future__ import annotations


class IdAllocator:
    """Gives ids from 1 on; one per video.

    Whatever reports regions, a track of the layers or a blob, takes its new ids here, so that two of
    them can never be the same. It is never begun anew: an id that was reported stays its region's.
    """

    def __init__(self) -> None:
        self.last = 0

    def new(self) -> int:
        """An id that nobody has had."""
        self.last += 1
        return self.last

    def reserve(self, number: int) -> None:
        """Give no id up to this one: it was reported before."""
        self.last = max(self.last, number)
