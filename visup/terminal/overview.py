"""What `visup --help` shows: the commands by what one wants, a short line each."""

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
            "watch": "watch a video and say whether the work goes well",
            "demo": "watch the shipped clip, a capture that fails",
            "check": "say beforehand whether a run can lead to anything",
            "serve": "many cameras under one supervisor, from a site file",
            "presets": "what --preset traffic, cell, orbit, bench choose",
        },
        "Prepare": {
            "teach": "show things once, so that they are known from then on",
            "models": "build, extend, list and query model databases",
            "task": "check, show, simulate and learn task files",
            "rules": "check, list and explain safety rules",
        },
        "Look into a run": {
            "console": "runs in the browser: timeline, beliefs, reasons",
            "step": "step through it, back and forth, and ask why",
            "replay": "reason again, with other tasks or rules",
            "export": "its objects for other tools: MOT, COCO, FiftyOne, CSV",
        },
        "Ask many runs": {
            "archive": "watch many clips; a lake with the tables of their runs",
            "query": "ask a lake in SQL",
            "find": "find where a condition was true, in all runs of a lake",
        },
        "Extend and measure": {
            "behaviours": "list, check and create plug-ins",
            "render": "render a scene with masks and truth",
            "eval": "compute figures against ground truth",
            "train": "learn from labelled sequences what moves by itself",
            "debug": "pictures of the workings, for those who improve them",
            "doctor": "what is installed, what is missing, how fast it is",
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

    def make_context(self, *given: Any, **named: Any) -> Any:
        """As any command; what is said of words that make no sense is printable."""
        with _printable_refusals():
            return super().make_context(*given, **named)

    def invoke(self, ctx: Any) -> Any:
        """As any command; what is said of words that make no sense is printable."""
        with _printable_refusals():
            return super().invoke(ctx)


@contextmanager
def _printable_refusals() -> Iterator[None]:
    """Names and values may come from strangers, and are quoted in refusals, which typer prints itself."""
    try:
        yield
    except Exception as refusal:
        if isinstance(refusal, _REFUSAL):
            from visup.wording import printable

            refusal.message = printable(refusal.message)
        raise


_REFUSAL: Any = BadParameter.__mro__[2]
"""What all refusals of typer are; older ones have it from click, newer ones of their own."""
