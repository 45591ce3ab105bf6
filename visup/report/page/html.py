"""The report: one HTML file that opens offline, with embedded pictures, figures and scripts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType

from visup.report.page import sections
from visup.report.page.distance_figures import distance_figures
from visup.report.page.downloads import downloads
from visup.report.page.figures import (
    Figure,
    likelihood_figures,
    presence_figure,
    stage_figure,
    vote_figures,
)
from visup.report.page.object_table import object_table
from visup.report.page.player import player
from visup.report.page.shell import filled_page, write_page
from visup.report.page.summary import title_of, verdict_words
from visup.report.page.task_trees import task_trees
from visup.report.records import RunData
from visup.wording import printable, prose

PARTS: Mapping[str, Callable[[RunData], str]] = MappingProxyType(
    {
        "title": lambda run: escape(title_of(run)),
        "verdict_word": lambda run: escape(verdict_words(run)[0]),
        "source": lambda run: escape(run.source),
        "verdict": sections.verdict_badge,
        "notices": sections.notices,
        "hero": sections.hero,
        "narrative": sections.narrative,
        "player": player,
        "alert_filter": sections.alert_filter,
        "alerts": sections.alerts,
        "objects": object_table,
        "key_frames": sections.key_frames,
        "tasks": sections.tasks,
        "courses": task_trees,
        "similarity": sections.similarity,
        "downloads": downloads,
        "facts": sections.run_facts,
    }
)
"""Placeholder -> content."""
FIGURES: Mapping[str, tuple[Callable[[RunData], Sequence[Figure | None]], str]] = MappingProxyType(
    {
        "stages": (lambda run: [stage_figure(run)], "No stage was followed."),
        "presence": (lambda run: [presence_figure(run)], "No object was followed."),
        "distances": (distance_figures, "No two objects were in view together."),
        "likelihoods": (likelihood_figures, "No object was identified."),
        "votes": (vote_figures, "No object was identified."),
    }
)
"""Figures in the order of the page, and the text if there are none."""
SCRIPTS = ("figures.js", "report.js", "cursor.js", "filters.js")


def write_report(run: RunData, path: Path) -> None:
    """Write the report of a run.

    Args:
        run: From `Collector.finish`.
        path: The file to write, replaced atomically.

    Raises:
        ExtraMissingError: The run has figures, and Plotly is not installed.
        OutputError: The file cannot be written.
    """
    write_page(report_page(run), path)


def report_page(run: RunData) -> str:
    """The whole page.

    Args:
        run: From `Collector.finish`.

    Returns:
        Self-contained HTML with links to the annotated videos next to it; it depends only on the run.

    Raises:
        ExtraMissingError: The run has figures, and Plotly is not installed.
    """
    figures_of_section = {name: [f for f in make(run) if f] for name, (make, _) in FIGURES.items()}
    all_figures = [f for figures in figures_of_section.values() for f in figures]
    body = (files("visup.report.page") / "report.html").read_text(encoding="utf-8")
    text = {name: part(run) for name, part in PARTS.items()}
    text |= {
        name: sections.figures(figures_of_section[name], empty)
        for name, (_, empty) in FIGURES.items()
    }
    text = {name: printable(prose(words)) for name, words in text.items()}
    title = f"{text['verdict_word']}: {text['title']} (visup report)"
    return filled_page(body, text, all_figures, title, SCRIPTS)
