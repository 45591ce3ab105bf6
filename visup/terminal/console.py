"""All output of visup goes through here, so that no untrusted text can control the terminal.

Names of models, texts of tasks or the answer of a server may contain escape sequences that clear the screen,
set its title or reverse the reading order. `tests/terminal/test_console.py` checks that nothing else in
visup prints. Output is also best effort: when the reader goes away (as in `visup watch ... | head -1`),
further output is dropped and the run continues.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderResult
    from rich.measure import Measurement


PIPE_WIDTH = 1000
"""Width of output that is not a terminal, columns."""


def make_console(*, unwrapped: bool = False, **options: Any) -> Console:
    """A rich console that prints only text passed by `printable`.

    Args:
        unwrapped: Whether to leave output to a pipe unwrapped and uncut.
        options: As for `rich.console.Console`; highlighting is off by default.
    """
    from rich.console import Console, RenderHook

    class Printable(RenderHook):
        def process_renderables(
            self, renderables: list[ConsoleRenderable]
        ) -> list[ConsoleRenderable]:
            return [_Cleaned(r) for r in renderables]

    class Patient(Console):
        def on_broken_pipe(self) -> None:
            self.quiet = True
            _discard_output()

    console = Patient(**{"highlight": False, **options})
    console.push_render_hook(Printable())
    if unwrapped and not console.is_terminal:
        console.width = PIPE_WIDTH
    return console


class _Cleaned:
    """A renderable stripped of characters that control the terminal."""

    def __init__(self, shown: ConsoleRenderable) -> None:
        self._shown = shown

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        from rich.segment import Segment

        from visup.wording import printable

        for text, style, control in console.render(self._shown, options):
            # Control segments are rich's own.
            yield Segment(text if control else printable(text), style, control)

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        from rich.measure import Measurement

        return Measurement.get(console, options, self._shown)


def echo(text: str = "", *, nl: bool = True) -> None:
    """Print a text, stripped of characters that control the terminal, and flush."""
    from visup.wording import printable

    _print(printable(text), "\n" if nl else "")


def echo_json(value: Any, **options: Any) -> None:
    """Print a value as JSON, on one line unless the options of `json.dumps` say otherwise."""
    from visup.wording import escaped_json

    _print(escaped_json(value, **options))


def _print(text: str, end: str = "\n") -> None:
    try:
        print(text, end=end, flush=True)
    except BrokenPipeError:
        _discard_output()


def _discard_output() -> None:
    """Discard further output; Python still flushes its buffers when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_error(message: str) -> None:
    """Print an error to standard error."""
    from rich.text import Text

    console = make_console(stderr=True, soft_wrap=True)
    console.print(Text("error: ", style="bold red") + Text(message))
