"""The report of a lake: one HTML file that opens offline."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from visup.archive.reporting.figures import all_figures, duration_figures, verdict_figure
from visup.archive.reporting.statistics import LakeStatistics, StageDuration
from visup.report.page.figures import Figure
from visup.report.page.sections import figures
from visup.report.page.shell import filled_page, write_page
from visup.wording import printable

DURATION_HEAD = ("task", "stage", "runs", "10th percentile", "median", "90th percentile", "longest")


def write_lake_page(statistics: LakeStatistics, lake: Path, path: Path) -> None:
    """Write the report of a lake.

    Raises:
        ExtraMissingError: There are figures, and Plotly is not installed.
        OutputError: The file cannot be written.
    """
    write_page(lake_page(statistics, lake), path)


def lake_page(statistics: LakeStatistics, lake: Path) -> str:
    """The whole page; it depends on the lake only.

    Raises:
        ExtraMissingError: There are figures, and Plotly is not installed.
    """
    text = {
        "title": escape(lake.absolute().name),
        "tiles": _tiles(statistics),
        "verdicts": figures([verdict_figure(statistics)], "No run has a date."),
        "durations": _duration_table(statistics.durations, ""),
        "weeks": figures(duration_figures(statistics), "No stage belongs to a run with a date."),
        "actors": _duration_table(statistics.by_actor, "actor = model, or label"),
        "drifts": _drifts(statistics),
        "failures": _failures(statistics),
    }
    return archive_page("lake.html", text, list(all_figures(statistics)), "all runs")


def archive_page(template: str, text: Mapping[str, str], figures: list[Figure], kind: str) -> str:
    """A page about many runs.

    Args:
        template: File name in this folder.
        text: Placeholder -> HTML.
        figures: The figures of the page.
        kind: Kind of page, in a word or two.

    Raises:
        ExtraMissingError: There are figures, and Plotly is not installed.
    """
    body = (files("visup.archive.reporting") / template).read_text(encoding="utf-8")
    shown = {name: printable(words) for name, words in text.items()}
    return filled_page(body, shown, figures, f"{shown['title']} (visup, {kind})")


def _tiles(statistics: LakeStatistics) -> str:
    ended: dict[str, int] = {}
    for _, verdict, count in statistics.verdicts:
        ended[verdict] = ended.get(verdict, 0) + count
    facts = {"runs": f"{statistics.runs:,}"}
    if statistics.hours < 1.0:
        facts["minutes of video"] = f"{60.0 * statistics.hours:.1f}"
    else:
        facts["hours of video"] = f"{statistics.hours:,.1f}"
    facts |= {v.replace("_", " "): f"{n:,}" for v, n in sorted(ended.items()) if v != "none"}
    tiles = (f"<div><dt>{escape(k)}</dt><dd>{escape(v)}</dd></div>" for k, v in facts.items())
    return f"<dl class=tiles>{''.join(tiles)}</dl>"


def _duration_table(of: Sequence[StageDuration], group: str) -> str:
    rows = [
        (
            *((d.group,) if group else ()),
            d.task,
            d.stage,
            f"{d.runs:,}",
            *(f"{s:.1f} s" for s in (d.low, d.mid, d.high, d.longest)),
        )
        for d in of
    ]
    head = (*((group,) if group else ()), *DURATION_HEAD)
    return html_table(head, rows, "No run has a stage.")


def _drifts(statistics: LakeStatistics) -> str:
    rows = [
        (
            d.task,
            d.stage,
            f"{d.before:.1f} s",
            f"{d.after:.1f} s",
            f"{d.change:+.0%}",
            f"{d.runs:,}",
            f"{d.chance:.1g}",
        )
        for d in statistics.drifts
    ]
    head = ("task", "stage", "first quarter", "last quarter", "change", "runs", "p")
    return html_table(head, rows, "No stage has become significantly slower or faster.")


def _failures(statistics: LakeStatistics) -> str:
    rows = [
        (f.stage or "none", f.alert.replace("_", " ") or "none", f"{f.runs:,}", f"{f.share:.0%}",
         f"{f.clip} ({f.run[:8]})")
        for f in statistics.failures
    ]  # fmt: skip
    head = ("failed stage", "most severe alert", "runs", "share of failures", "example")
    return html_table(head, rows, "No run failed.")


def html_table(head: Iterable[str], rows: Iterable[Iterable[str]], empty: str) -> str:
    """An HTML table of escaped texts; a sentence if there are no rows."""
    lines = "".join(f"<tr>{''.join(f'<td>{escape(c)}' for c in row)}" for row in rows)
    if not lines:
        return f"<p class=empty>{escape(empty)}</p>"
    first = "".join(f"<th>{escape(c)}" for c in head)
    return (
        f"<div class=scroll><table><thead><tr>{first}</thead><tbody>{lines}</tbody></table></div>"
    )
