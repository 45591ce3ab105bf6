"""The console of a supervisor: nobody has to read it."""

from __future__ import annotations

import os
import sys

from rich.console import Console


class PatientConsole(Console):
    """A console whose reader may go away (`visup watch ... | head -1`); what is said then is lost."""

    def on_broken_pipe(self) -> None:
        """Say nothing more. Whoever runs goes on: that nobody reads its log is no reason to stop."""
        self.quiet = True
        # What is still buffered is flushed when Python ends, and must go somewhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
