"""Past observations, stored as compactly as in a journal."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

from pydantic_core import from_json, to_json

from visup.agent import Observation
from visup.agent.storage.codec import from_document, to_document

_LEVEL = 1  # zlib; see the codec


@dataclass(slots=True)
class ObservationLog:
    """Observations by number: number n led from step n to step n + 1.

    Observations that the codec does not support (values of plug-ins) are stored unchanged.
    """

    _stored: list[bytes | Observation] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self._stored)

    def add(self, observation: Observation) -> None:
        """Add an observation."""
        document = to_document(observation)
        incomplete = any("lost" in report for report in document["reports"])
        packed = zlib.compress(to_json(document, inf_nan_mode="constants"), _LEVEL)
        self._stored.append(observation if incomplete else packed)

    def observation(self, number: int) -> Observation:
        """The observation after step `number`."""
        kept = self._stored[number]
        if isinstance(kept, Observation):
            return kept
        return from_document(from_json(zlib.decompress(kept)))
