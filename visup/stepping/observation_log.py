"""What was perceived, step by step, as compactly as a journal holds it: the past to go back into."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field

from pydantic_core import from_json, to_json

from visup.agent import Observation
from visup.agent.storage.codec import from_document, to_document

_LEVEL = 1  # of zlib; see the codec


@dataclass(slots=True)
class ObservationLog:
    """Observations by number: number n led from step n to step n + 1.

    What the journal's form cannot hold (a plug-in's value of a kind of its own) is kept as it is.
    """

    _seen: list[bytes | Observation] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self._seen)

    def add(self, observation: Observation) -> None:
        """Keep one more."""
        told = to_document(observation)
        lost = any("lost" in report for report in told["reports"])
        packed = zlib.compress(to_json(told, inf_nan_mode="constants"), _LEVEL)
        self._seen.append(observation if lost else packed)

    def seen(self, number: int) -> Observation:
        """What was perceived after step `number`."""
        kept = self._seen[number]
        if isinstance(kept, Observation):
            return kept
        return from_document(from_json(zlib.decompress(kept)))
