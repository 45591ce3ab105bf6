"""The shell of self-contained pages: head, style, scripts, and content security policy."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template

from visup.agent.model.errors import ExtraMissingError, OutputError
from visup.agent.storage.atomic import write_atomically
from visup.report.page.figures import Figure

COMMON_TEXTS = {
    "noscript": '<noscript><p class="notice">The figures need scripts to be drawn; everything else on this'
    " page, and each figure in words, is here without them.</p></noscript>",
    "whole": "Written by visup. This page is self-contained and loads nothing from the network.",
}
"""Common texts of pages, by placeholder."""
MEDIA = " media-src 'self' file:;"
"""Policy of a page with a video; other pages load nothing."""


def filled_page(
    body: str,
    text: Mapping[str, str],
    figures: Sequence[Figure],
    title: str,
    scripts: Sequence[str] = ("figures.js",),
) -> str:
    """A self-contained page.

    Args:
        body: Template of the body.
        text: Placeholder -> HTML without control characters.
        figures: The figures of the page.
        title: Title of the window, as HTML.
        scripts: File names in this folder; only these scripts may run.

    Raises:
        ExtraMissingError: There are figures, and Plotly is not installed.
    """
    folder = files("visup.report.page")
    plotly = plotly_source() if figures else ""
    script = "".join((folder / name).read_text(encoding="utf-8") for name in scripts)
    filled = Template(body).substitute(text, **COMMON_TEXTS).rstrip()
    return Template((folder / "shell.html").read_text(encoding="utf-8")).substitute(
        title=title,
        body=filled,
        media=MEDIA if "<video" in filled else "",
        figures=embedded(figures),
        style=(folder / "report.css").read_text(encoding="utf-8"),
        plotly=plotly,
        script=script,
        scripts_allowed=" ".join(map(_script_hash, (plotly, script))),
    )


def write_page(page: str, path: Path) -> None:
    """Write a page atomically.

    Raises:
        OutputError: The file cannot be written.
    """
    try:
        write_atomically(path, page.encode())
    except OSError as fault:
        raise OutputError(
            f"the report cannot be written ({fault.strerror or fault})",
            where=str(path),
            hint="choose a folder that exists and that you may write to",
        ) from fault


def _script_hash(script: str) -> str:
    """The hash of a script for the content security policy."""
    digest = hashlib.sha256(script.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def embedded(figures: Sequence[Figure]) -> str:
    """Figures as JSON that is safe inside a script element."""
    values = [{"id": f.key, "data": f.traces, "layout": f.layout} for f in figures]
    text = json.dumps(values, separators=(",", ":"), allow_nan=False)
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")


def plotly_source() -> str:
    """Plotly's own script, from the installed package.

    Raises:
        ExtraMissingError: It is not installed.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as missing:
        raise ExtraMissingError("the report", "report") from missing
    return str(get_plotlyjs())
