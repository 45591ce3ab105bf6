"""The sections of the report as HTML; all text is escaped here."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from visup.agent import Alert, Event, Severity, StageBelief, TaskBelief
from visup.report.page.figures import Figure
from visup.report.page.summary import (
    SEVERITY_WORDS,
    called,
    picture_words,
    spoken,
    summary,
    verdict_words,
)
from visup.report.palette import OBJECT_COLOURS, css, object_colour
from visup.report.records import KeyFrame, RegionCloseup, RunData

MARKS = {Severity.INFO: "•", Severity.WARNING: "▲", Severity.CRITICAL: "◆"}
MIN_FILTERED = 4
"""Fewer alerts need no filter."""
MANY_OBJECTS, FEW_FRAMES = 12, 8
"""With more than this many objects the gallery is limited to the second number of pictures."""
MAX_COMPARED = 10
"""Maximum key frames in the similarity table; the journal has all hypotheses."""


def hero(run: RunData) -> str:
    """The summary and the most important picture."""
    heaviest = max(run.key_frames, key=lambda k: (k.weight, k.time), default=None)
    picture = f"<div class=hero-picture>{_image(run, heaviest)}</div>" if heaviest else ""
    words = f"<p class=lead>{escape(summary(run))}</p>{_tiles(run)}{_videos(run)}"
    return f"<div class=hero><div>{words}</div>{picture}</div>"


def verdict_badge(run: RunData) -> str:
    """The verdict as a badge with its meaning."""
    word, meaning = verdict_words(run)
    kind = run.verdict.value if run.verdict else "none"
    return (
        f'<p class="verdict verdict-{kind}"><strong>{escape(word)}</strong> '
        f"<span>{escape(meaning)}</span></p>"
    )


def notices(run: RunData) -> str:
    """Important notices: a truncated source, assumptions."""
    problem = (
        [f'<p class="notice grave" role=note>{escape(run.problem)}</p>'] if run.problem else []
    )
    return "".join([*problem, *(f"<p class=notice role=note>{escape(n)}</p>" for n in run.notes)])


def _tiles(run: RunData) -> str:
    count = sum(a.severity > Severity.INFO for a in run.alerts)
    facts = {
        "duration": f"{run.duration:.1f} s",
        "frames": str(run.frames),
        "object" if len(run.objects) == 1 else "objects": str(len(run.objects)),
        "alert" if count == 1 else "alerts": str(count),
    }
    return f"<dl class=tiles>{''.join(_tile(k, v) for k, v in facts.items())}</dl>"


def _videos(run: RunData) -> str:
    """Links to the annotated videos, which are next to the page."""
    parts = [f", part {n}" for n in range(1, len(run.videos) + 1)] if run.videos[1:] else [""]
    links = (
        f'<a href="{quote(name)}">Annotated video{part}</a>'
        for name, part in zip(run.videos, parts, strict=False)
    )
    return f"<p class=videos>{' '.join(links)}</p>" if run.videos else ""


def _tile(name: str, value: str) -> str:
    return f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>"


def narrative(run: RunData) -> str:
    """All sentences in order, each linked to the nearest key frame."""
    if not run.events:
        return "<p class=empty>Nothing notable happened.</p>"
    shown = shown_frames(run)
    lines = "".join(_event_line(run, e, nearest(shown, e)) for e in run.events)
    more = (
        f"<p class=empty>{run.events_left_out} later events are only in the journal.</p>"
        if run.events_left_out
        else ""
    )
    return f"<ol class=narrative>{lines}</ol>{more}"


def nearest(key_frames: Sequence[KeyFrame], event: Event) -> KeyFrame | None:
    """The key frame closest in time to an event, or None."""
    return min(key_frames, key=lambda k: (abs(k.time - event.time), k.time), default=None)


def _time(run: RunData, seconds: float, lead: str = "") -> str:
    """A time of the source, with the wall-clock time if known."""
    wall = run.clock.text(seconds)
    if wall is None:
        return f"<time>{lead}{seconds:.1f} s</time>"
    clock = f"<span class=clock>{wall[11:19]}</span>"
    return f'<time datetime="{wall}" title="{wall}">{lead}{seconds:.1f} s {clock}</time>'


def _event_line(run: RunData, event: Event, key: KeyFrame | None) -> str:
    word = SEVERITY_WORDS[event.severity]
    time = _time(run, event.time)
    mark = f'<span class=mark title="{word}" aria-label="{word}">{MARKS[event.severity]}</span>'
    text = f"{time}{mark}<span>{escape(event.text)}</span>"
    inside = f'<a href="#{_anchor(key)}">{text}</a>' if key else f"<div>{text}</div>"
    return f'<li class="told {word}" data-time="{event.time:.3f}">{inside}</li>'


def alerts(run: RunData) -> str:
    """Each alert with its times and its evidence."""
    if not run.alerts:
        return "<p class=empty>No alert was raised.</p>"
    return f"<ul class=alerts>{''.join(_alert(run, a) for a in run.alerts)}</ul>"


def alert_filter(run: RunData) -> str:
    """Filters of the alert list, for properties with several values."""
    if len(run.alerts) < MIN_FILTERED:
        return ""
    severities = sorted({a.severity for a in run.alerts}, reverse=True)
    kinds = sorted({a.kind for a in run.alerts})
    return (
        "<div class=alert-filter hidden role=search aria-label='Filter alerts'>"
        + _choice("Severity", [(SEVERITY_WORDS[s], SEVERITY_WORDS[s]) for s in severities])
        + _choice("Kind", [(k, k.replace("_", " ")) for k in kinds])
        + "<label><input type=checkbox> still open</label>"
        + "<input type=search placeholder='words' aria-label='Words in the alert'><output></output></div>"
    )


def _choice(name: str, values: Iterable[tuple[str, str]]) -> str:
    options = "".join(
        f'<option value="{escape(v)}">{escape(words)}</option>' for v, words in values
    )
    return f'<select aria-label="{name}"><option value="">{name}: all</option>{options}</select>'


def _alert(run: RunData, alert: Alert) -> str:
    word = SEVERITY_WORDS[alert.severity]
    until = "still open at the end" if alert.closed is None else f"closed at {alert.closed:.1f} s"
    names = "; ".join(called(run, i) for i in alert.objects)
    opened = " data-open" if alert.closed is None else ""
    evidence = "".join(f"<li>{escape(e)}</li>" for e in alert.evidence)
    return (
        f'<li class="alert {word}" data-severity="{word}" data-kind="{escape(alert.kind)}"{opened}>'
        f"<p class=alert-head><span class=tag>{word}</span> "
        f"<strong>{escape(alert.kind.replace('_', ' '))}</strong> "
        f"{_time(run, alert.opened, 'from ')}, {until}</p>"
        f"<p>{escape(alert.cause)}</p>"
        + (f"<p class=quiet>{escape(names)}</p>" if names else "")
        + (f"<p class=quiet>Evidence</p><ul class=evidence>{evidence}</ul>" if evidence else "")
        + "</li>"
    )


def key_frames(run: RunData) -> str:
    """The annotated pictures with anchors for the narrative."""
    if not run.key_frames:
        return "<p class=empty>No frame was seen.</p>"
    return f"<div class=gallery>{''.join(_key_frame(run, k) for k in shown_frames(run))}</div>"


def shown_frames(run: RunData) -> Sequence[KeyFrame]:
    """The key frames of the gallery: fewer if there are many objects, which have their own section."""
    if len(run.objects) <= MANY_OBJECTS:
        return run.key_frames
    heaviest = sorted(run.key_frames, key=lambda k: (-k.weight, k.time))[:FEW_FRAMES]
    return sorted(heaviest, key=lambda k: k.time)


def _key_frame(run: RunData, key: KeyFrame) -> str:
    captions = "".join(f"<span>{escape(c)}</span>" for c in key.captions)
    return (
        f'<figure id="{_anchor(key)}" tabindex=-1><button type=button class=open '
        f'aria-label="Enlarge the picture at {key.time:.1f} s">{_image(run, key)}</button>'
        f"<figcaption><time>{key.time:.1f} s</time> <b class=quiet>frame {key.frame_index}</b>"
        f"{captions}</figcaption></figure>"
    )


def _anchor(key: KeyFrame) -> str:
    return f"frame-{key.frame_index}"


def _image(run: RunData, key: KeyFrame) -> str:
    width, height = key.size
    words = escape(picture_words(run, key))
    return f'<img src="{_data(key.jpeg)}" width={width} height={height} alt="{words}">'


def _data(jpeg: bytes) -> str:
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode('ascii')}"


def tasks(run: RunData) -> str:
    """The final state of each task: actors, and how each stage ended and why."""
    if not run.tasks:
        return "<p class=empty>There was no task to follow.</p>"
    return "".join(_task(run, t) for t in run.tasks)


def _task(run: RunData, task: TaskBelief) -> str:
    cast = "; ".join(
        f"{b.actor}: {called(run, b.object_id)} ({b.strength:.0%})".replace("%", " %")
        if b.object_id is not None
        else f"{b.actor}: nobody"
        for b in task.bindings
    )
    rows = "".join(_stage(s) for s in task.stages)
    return (
        f"<h3>Task “{escape(task.task)}”: {escape(task.verdict.value.replace('_', ' '))}</h3>"
        + (f"<p>{escape(task.evidence)}</p>" if task.evidence else "")
        + (f"<p class=quiet>{escape(cast)}</p>" if cast else "")
        + f"<div class=scroll><table><thead><tr><th>stage<th>status<th>since<th>why</thead>"
        f"<tbody>{rows}</tbody></table></div>"
    )


def _stage(stage: StageBelief) -> str:
    status = escape(stage.status.value)
    return (
        f'<tr><th scope=row>{escape(stage.stage)}</th><td><span class="status {status}">{status}'
        f"</span></td><td>{stage.since:.1f} s</td><td>{escape(stage.evidence)}</td></tr>"
    )


def figures(all_figures: Iterable[Figure | None], empty: str) -> str:
    """Containers in which the page's script draws the figures, with captions."""
    shown = [f for f in all_figures if f is not None]
    if not shown:
        return f"<p class=empty>{escape(empty)}</p>"
    return f"<div class=figures>{''.join(_figure(f) for f in shown)}</div>"


def _figure(figure: Figure) -> str:
    height = int(figure.layout["height"])
    return (
        f"<figure class=plot><h3>{escape(figure.title)}</h3>"
        f'<div id="{escape(figure.key)}" class=plot-area style="min-height:{height}px" role=img '
        f'aria-label="{escape(figure.title)}: {escape(figure.caption)}"></div>'
        f"<figcaption>{escape(figure.caption)}</figcaption></figure>"
    )


def similarity(run: RunData) -> str:
    """The best hypotheses for each region at key frames (paper, figure 4)."""
    compared = [k for k in shown_frames(run) if any(closeup.matches for closeup in k.closeups)]
    heaviest = sorted(compared, key=lambda k: (-k.weight, k.time))[:MAX_COMPARED]
    if not heaviest:
        return "<p class=empty>No region was compared with models; use --models DB.</p>"
    return "".join(_similarity_row(k) for k in sorted(heaviest, key=lambda k: k.time))


def _similarity_row(key: KeyFrame) -> str:
    cards = "".join(_closeup(closeup, key.time) for closeup in key.closeups)
    return (
        f'<h3><a href="#{_anchor(key)}">{key.time:.1f} s</a> '
        f"<b class=quiet>frame {key.frame_index}</b></h3><div class=looks>{cards}</div>"
    )


def _closeup(closeup: RegionCloseup, time: float) -> str:
    colour = css(object_colour(closeup.object_id)) if closeup.object_id else css(OBJECT_COLOURS[0])
    rows = "".join(
        f"<tr{' class=agreed' if m.name == closeup.believed else ''}><td>{i}</td>"
        f"<td>{escape(m.name)}</td><td>{m.view}</td>"
        f"<td class=bar><i style='width:{100 * min(max(m.similarity, 0), 1):.0f}%'></i>"
        f"<span>{m.similarity:.2f}</span></td></tr>"
        for i, m in enumerate(closeup.matches, start=1)
    )
    table = (
        f"<table><thead><tr><th>rank<th>model<th>view<th>similarity</thead><tbody>{rows}</tbody>"
        "</table>"
        if rows
        else "<p class=quiet>No hypothesis.</p>"
    )
    believed = f"{spoken(closeup.believed)} {closeup.share:.0%}".replace("%", " %")
    if closeup.matches and abs(closeup.matched_at - time) > 0.05:
        believed += f", compared at {closeup.matched_at:.1f} s"
    return (
        f'<div class=look style="--object:{colour}"><div class=crop><img src="{_data(closeup.jpeg)}" '
        f'alt="Region {closeup.region_id} cut out of the frame"></div><div><p><b>Region '
        f"{closeup.region_id}</b>, believed to be {escape(believed)}</p>{table}</div></div>"
    )


def run_facts(run: RunData) -> str:
    """Settings, versions, and the cost of each behaviour."""
    rows = "".join(
        f"<tr><th scope=row>{escape(k)}</th><td>{escape(v)}</td></tr>" for k, v in flat(run.facts)
    )
    table = (
        f"<div class=scroll><table class=facts><tbody>{rows}</tbody></table></div>" if rows else ""
    )
    return table + _behaviour_costs(run) or "<p class=empty>Nothing was noted.</p>"


def flat(facts: Mapping[str, Any], lead: str = "") -> list[tuple[str, str]]:
    """Nested facts as rows of name and text, without empty ones.

    >>> flat({"every": 2, "actors": {"arm": ["rms_arm", "crane"]}, "rules": []})
    [('every', '2'), ('actors, arm', 'rms_arm, crane')]
    """
    rows: list[tuple[str, str]] = []
    for key, value in facts.items():
        name = f"{lead}{str(key).replace('_', ' ')}"
        if isinstance(value, Mapping):
            rows += flat(value, f"{name}, ")
        elif isinstance(value, list | tuple):
            rows += [(name, ", ".join(map(str, value)))] if value else []
        elif value is not None and value != "":
            rows.append((name, f"{value:g}" if isinstance(value, float) else str(value)))
    return rows


def _behaviour_costs(run: RunData) -> str:
    if not run.behaviour_costs:
        return ""
    rows = "".join(
        f"<tr><th scope=row>{escape(e.behaviour)}</th><td>{e.runs}</td><td>{e.failures}</td>"
        f"<td>{e.mean_ms:.1f} ms</td></tr>"
        for e in run.behaviour_costs
    )
    return (
        "<div class=scroll><table><thead><tr><th>behaviour<th>runs<th>failures<th>mean time</thead>"
        f"<tbody>{rows}</tbody></table></div>"
    )
