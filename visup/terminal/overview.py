"""What `visup --help` shows: the commands grouped by purpose, one line each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any

from typer import BadParameter
from typer.core import TyperGroup

PURPOSES: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "Watch": {
            "watch": "watch a video and report whether the work goes well",
            "demo": "watch the shipped clip, a failed capture",
            "check": "check that a run could start and reach a verdict",
            "serve": "watch many cameras as a service, from a site file",
            "presets": "what --preset traffic, cell, orbit and bench set",
        },
        "Prepare": {
            "teach": "outline objects once, so that they are recognised",
            "models": "build, extend, list and query model databases",
            "task": "check, show, simulate and learn task files",
            "rules": "check, list and explain safety rules",
        },
        "Inspect a run": {
            "console": "browse runs: video, timeline, beliefs, reasons",
            "step": "step back and forth through a run, and ask why",
            "replay": "reason again about a run, with other tasks or rules",
            "export": "export objects as MOT, COCO, FiftyOne or CSV",
        },
        "Query many runs": {
            "archive": "watch many clips and store their runs in a lake",
            "query": "query a lake in SQL",
            "find": "find where a condition held, in all runs of a lake",
        },
        "Extend and measure": {
            "behaviours": "list, check and create plug-ins",
            "render": "render a scene with masks and ground truth",
            "eval": "measure accuracy and speed against ground truth",
            "train": "learn from labelled sequences what moves independently",
            "debug": "visualise intermediate results, for developers",
            "doctor": "show what is installed, what is missing, how fast it runs",
        },
    }
)


class Overview(TyperGroup):
    """The top of the command line; its help shows commands by their purpose."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands."""
        for purpose, commands in PURPOSES.items():
            with formatter.section(purpose):
                formatter.write_dl(list(commands.items()))

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """As usual, but error messages about bad arguments are made printable."""
        with _printable_errors():
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        """As usual, but error messages about bad arguments are made printable."""
        with _printable_errors():
            return super().invoke(ctx)


@contextmanager
def _printable_errors() -> Iterator[None]:
    """Typer prints its own error messages, which quote names and values that may be untrusted."""
    try:
        yield
    except Exception as error:
        if isinstance(error, _USAGE_ERROR):
            from visup.wording import printable

            error.message = printable(error.message)
        raise


_USAGE_ERROR: Any = BadParameter.__mro__[2]
"""Base class of typer's usage errors: click's in older versions, its own in newer ones."""
