"""Runs on disk: journals of what happened, and checkpoints to resume from.

Read `journal.py` (written step by step, SQLite) and `journal_reader.py` (read back); `codec.py` on
`mask_codec.py` packs observations to the last bit, `jsonable.py` gives records as plain JSON,
`checkpoint.py` saves the state of an agent.

Names are loaded on first use: the process of an isolated behaviour encodes, but writes no journal.
"""

from typing import TYPE_CHECKING

from visup.agent.lazy_names import lazy_names

if TYPE_CHECKING:
    from visup.agent.storage.journal import Journal, JournalLimits
    from visup.agent.storage.journal_reader import Recording

__all__ = ["Journal", "JournalLimits", "Recording"]

__getattr__ = lazy_names(
    __name__,
    {
        "visup.agent.storage.journal": ("Journal", "JournalLimits"),
        "visup.agent.storage.journal_reader": ("Recording",),
    },
)
