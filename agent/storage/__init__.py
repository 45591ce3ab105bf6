"""Runs on disk: journals of what happened, and checkpoints to resume from.

Read `journal.py` (written step by step, SQLite) and `journal_reader.py` (read back); `codec.py` on
`_codec_jit.py` packs observations to the last bit, `jsonable.py` gives records as plain JSON,
`checkpoint.py` saves the state of an agent.
"""

from visup.agent.storage.journal import Journal, JournalLimits
from visup.agent.storage.journal_reader import Recording

__all__ = ["Journal", "JournalLimits", "Recording"]
