"""Allocation of public region ids, each given once."""

from __future__ import annotations


class IdAllocator:
    """Gives ids from 1 on; one per video.

    Everything that reports regions, layer tracks and blobs alike, takes its ids here, so that no two can be
    the same. It is never reset: a reported id stays its region's.
    """

    def __init__(self) -> None:
        self.last = 0

    def new(self) -> int:
        """An unused id."""
        self.last += 1
        return self.last

    def reserve(self, number: int) -> None:
        """Never allocate an id up to this one, which was reported before."""
        self.last = max(self.last, number)
