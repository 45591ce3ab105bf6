"""The clicked object: candidate names, similarity of views, and votes over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from html import escape

from nicegui import ui

from visup.agent import Hypothesis
from visup.console.drawing.flow_svg import percent
from visup.console.pages.page_elements import safe_text, section_heading, text_button
from visup.console.pages.playhead import Playhead
from visup.report.page.figures import CANDIDATE_COLOURS

MAX_CURVES = 5
CURVE_HEIGHT = 90
Samples = Sequence[tuple[float, Mapping[str, float]]]


def show_object(head: Playhead, key: str, number: int, samples: Samples) -> None:
    """Lay out an object at the cursor.

    Args:
        head: The cursor.
        key: Key of the run.
        number: Number of the object.
        samples: Shares of its names over time.
    """
    section_heading(f"Identity of object {number}")
    peaks: dict[str, float] = {}
    for _, shares in samples:
        for name, share in shares.items():
            peaks[name] = max(peaks.get(name, 0.0), share)
    best = sorted(peaks, key=lambda n: (-peaks[n], n))[:MAX_CURVES]
    matches = head.run.matches(head.number, number)
    if not best and not matches:
        ui.label("No model has matched it.").classes("dim")
        return
    belief = head.run.mind(head.number).objects.get(number)
    now = {c.name: c.share for c in belief.candidates} if belief else {}
    names = [*best, *(n for n in dict.fromkeys(h.name for h in matches) if n not in best)]
    _table(names[: len(CANDIDATE_COLOURS)], now, matches)
    if best:
        start = head.run.start
        since = [(time - start, shares) for time, shares in samples]
        cursor = head.run.share(head.run.times[head.number])
        ui.html(_curves(since, best, head.run.seconds - start, cursor), sanitize=False).classes(
            "w-full"
        )
    if matches and head.run.settings and head.run.settings.models:
        address = f"/likeness/{key}/{head.number}/{number}.jpg"
        text_button("Compare views", partial(_show_view_comparison, address, number))


def _show_view_comparison(address: str, number: int) -> None:
    """Show the silhouette and the most similar views in a dialog."""
    description = f"Silhouette of object {number} beside the views that it looks like"
    with ui.dialog(value=True) as dialog, ui.card().classes("likeness"):
        dialog.props(f'aria-label="{description}"')
        ui.element("img").props(f'src="{address}" alt="{description}"')
        text_button("Close", dialog.close)
    dialog.on("hide", dialog.delete)


def _table(names: Sequence[str], now: Mapping[str, float], matches: Sequence[Hypothesis]) -> None:
    """A table of names with their shares of the votes and the similarity of their best views."""
    best_matches = {h.name: h for h in reversed(matches)}
    with ui.element("table").classes("candidates"):
        with ui.element("thead"), ui.element("tr"):
            for heading in ("", "name", "votes", "similarity", "view"):
                with ui.element("th").props("scope=col"):
                    ui.label(heading or "colour").classes("" if heading else "sr-only")
        with ui.element("tbody"):
            for name, colour in zip(names, CANDIDATE_COLOURS, strict=False):
                match = best_matches.get(name)
                cells = (
                    name,
                    percent(now.get(name, 0.0)),
                    f"{match.similarity:.2f}" if match else "",
                    str(match.view) if match else "",
                )
                with ui.element("tr"):
                    with ui.element("td"):
                        ui.element("span").classes("swatch block").style(f"background:{colour}")
                    for text in cells:
                        with ui.element("td"):
                            ui.label(safe_text(text))


def _curves(samples: Samples, names: Sequence[str], seconds: float, cursor: float) -> str:
    """The shares of names over time with the cursor, as SVG."""
    lines = "".join(
        _curve(samples, name, colour, max(seconds, 1e-6))
        for name, colour in zip(names, CANDIDATE_COLOURS, strict=False)
    )
    description = escape(f"Share of the votes over time for {', '.join(names)}", quote=True)
    x = f"{1000 * cursor:.1f}"
    return (
        f'<svg viewBox="0 0 1000 {CURVE_HEIGHT}" preserveAspectRatio="none" width="100%" '
        f'height="{CURVE_HEIGHT}" role="img" aria-label="{description}">{lines}'
        f'<line class="now" x1="{x}" x2="{x}" y1="0" y2="{CURVE_HEIGHT}"/></svg>'
    )


def _curve(samples: Samples, name: str, colour: str, seconds: float) -> str:
    points = " ".join(
        f"{1000 * time / seconds:.1f},{(1 - shares.get(name, 0.0)) * (CURVE_HEIGHT - 4) + 2:.1f}"
        for time, shares in samples
    )
    return (
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2" '
        'vector-effect="non-scaling-stroke"/>'
    )
