"""What pages that hold all that they show have in common: head, style, scripts, and what these may do."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template

from visup.agent.model.errors import ExtraMissingError, OutputError
from visup.agent.storage.atomic import write_whole
from visup.report.page.figures import Figure

SAID = {
    "noscript": '<noscript><p class="notice">The figures need scripts to be drawn; everything else on this'
    " page, and each figure in words, is here without them.</p></noscript>",
    "whole": "Written by visup. This page is self-contained and loads nothing from the network.",
}
"""What bodies of pages may name, and every page says alike."""
MEDIA = " media-src 'self' file:;"
"""What a page with a video may load besides itself; any other loads nothing."""


def filled_page(
    body: str,
    text: Mapping[str, str],
    drawn: Sequence[Figure],
    title: str,
    scripts: Sequence[str] = ("figures.js",),
) -> str:
    """A page that needs nothing outside itself.

    Args:
        body: Template of what stands between the tags of the body.
        text: What stands in its places, as HTML without characters that control.
        drawn: All figures that it names.
        title: Of the window, as HTML.
        scripts: Names of files in this folder. Only these may run.

    Raises:
        ExtraMissingError: There are figures, and Plotly is not installed.
    """
    own = files("visup.report.page")
    plotly = plotly_source() if drawn else ""
    script = "".join((own / name).read_text(encoding="utf-8") for name in scripts)
    filled = Template(body).substitute(text, **SAID).rstrip()
    return Template((own / "shell.html").read_text(encoding="utf-8")).substitute(
        title=title,
        body=filled,
        media=MEDIA if "<video" in filled else "",
        figures=embedded(drawn),
        style=(own / "report.css").read_text(encoding="utf-8"),
        plotly=plotly,
        script=script,
        scripts_allowed=" ".join(map(_script_hash, (plotly, script))),
    )


def write_page(page: str, path: Path) -> None:
    """Write a page whole or not at all.

    Raises:
        OutputError: The file cannot be written.
    """
    try:
        write_whole(path, page.encode())
    except OSError as fault:
        raise OutputError(
            f"the report cannot be written ({fault.strerror or fault})",
            where=str(path),
            hint="choose a folder that exists and that you may write to",
        ) from fault


def _script_hash(script: str) -> str:
    """A script as a content security policy allows it, and no other."""
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
