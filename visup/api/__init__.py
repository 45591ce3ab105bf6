"""The public API: watch a source, open a recorded run, and get both as tables and pictures.

Read in this order: `watching.py` (`visup.watch` and the run that it returns), `watch_options.py` (the options
of a run), `recorded.py` (`visup.open_run`), `records.py` (sequences of records that become
tables). Users take these names from `visup` itself.
"""

from visup.api.recorded import RecordedRun, open_run
from visup.api.records import Records
from visup.api.watching import Run, watch

__all__ = ["RecordedRun", "Records", "Run", "open_run", "watch"]
