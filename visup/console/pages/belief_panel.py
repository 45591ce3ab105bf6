"""What is believed at the cursor: tasks with their stages, who is there, and how sure each name is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from nicegui import ui

from visup.agent import Mind, ObjectBelief, Presence, TaskBelief
from visup.agent.model.errors import VisupError
from visup.console.pages.frame import OTHER_COLOUR, VERDICT_COLOURS, badge, shown_text
from visup.console.pages.playhead import Playhead
from visup.report.page.figures import CANDIDATE_COLOURS
from visup.report.palette import STATUS_COLOURS, css, object_colour
from visup.rules.wording.sentences import called, spaced

MOST_OBJECTS = 30
MOST_CURVES = 5
CURVE_HEIGHT = 90


def belief_panel(head: Playhead) -> None:
    """Lay out the panel; it follows the cursor."""
    chosen: dict[str, int | None] = {"id": None}

    @ui.refreshable
    def now() -> None:
        try:
            mind = head.run.mind(head.number)
        except VisupError as fault:
            ui.label(shown_text(str(fault)))
            return
        _health(mind)
        for task in mind.tasks:
            _task(task)
        _objects(mind, choose)

    def choose(number: int) -> None:
        chosen["id"] = None if chosen["id"] == number else number
        identity.refresh()

    @ui.refreshable
    def identity() -> None:
        if (number := chosen["id"]) is not None:
            _identity(head, number)

    now()
    identity()
    head.listen(now.refresh, "Now")


def _part(title: str) -> None:
    with ui.element("h2").classes("part"):
        ui.label(title)


def _health(mind: Mind) -> None:
    if mind.health.status.value != "ok":
        with ui.element("div").classes("line critical"):
            status = mind.health.status.value.replace("_", " ")
            ui.label(f"camera: {status}  {shown_text(mind.health.detail)}").classes("said")
    if mind.unknown:
        ui.label(f"not observed now: {', '.join(sorted(mind.unknown))}").classes("dim")


def _task(task: TaskBelief) -> None:
    _part(f"Task {shown_text(task.task)}")
    verdict = task.verdict.value
    badge(verdict.replace("_", " "), VERDICT_COLOURS.get(verdict, OTHER_COLOUR))
    for stage in task.stages:
        here = stage.stage == task.current
        with ui.element("div").classes("line now" if here else "line"):
            ui.element("span").classes("swatch").style(
                f"background:{css(STATUS_COLOURS[stage.status])}"
            )
            ui.label(shown_text(stage.stage)).classes("said")
            ui.label(stage.status.value).classes("dim")


def _objects(mind: Mind, choose: object) -> None:
    found = sorted(mind.present(), key=lambda b: b.id)[:MOST_OBJECTS]
    _part("In view" if found else "Nothing is in view")
    for belief in found:
        with ui.element("div").classes("line"):
            colour = css(object_colour(belief.id))
            ui.element("span").classes("swatch").style(f"background:{colour}")
            name = ui.element("button").classes("plain said")
            name.props["aria-label"] = f"identity of object {belief.id} over time"
            name.on("click", lambda number=belief.id: choose(number))  # type: ignore[operator]
            with name:
                ui.label(_called(belief, mind))
            ui.label(_surely(belief)).classes("dim")


def _called(belief: ObjectBelief, mind: Mind) -> str:
    name = spaced(called(mind, belief.name)) if belief.candidates else "not identified"
    return shown_text(f"{belief.id}  {name}")


def _surely(belief: ObjectBelief) -> str:
    share = f"{belief.strength:.0%}".replace("%", " %") if belief.candidates else ""
    return share if belief.presence is Presence.SEEN else f"{belief.presence.value}  {share}"


def _identity(head: Playhead, number: int) -> None:
    """How sure each name of an object was over time."""
    samples = list(head.run.shares(number))
    peaks: dict[str, float] = {}
    for _, shares in samples:
        for name, share in shares.items():
            peaks[name] = max(peaks.get(name, 0.0), share)
    best = sorted(peaks, key=lambda n: (-peaks[n], n))[:MOST_CURVES]
    _part(f"Who is object {number}")
    if not best:
        ui.label("No model was ever found to look like it.").classes("dim")
        return
    ui.html(_curves(samples, best, head.run.seconds), sanitize=False).classes("w-full")
    for name, colour in zip(best, CANDIDATE_COLOURS, strict=False):
        with ui.element("div").classes("line"):
            ui.element("span").classes("swatch").style(f"background:{colour}")
            ui.label(shown_text(name)).classes("said")
            ui.label(f"at most {peaks[name]:.0%}".replace("%", " %")).classes("dim")


def _curves(
    samples: Sequence[tuple[float, Mapping[str, float]]], names: Sequence[str], seconds: float
) -> str:
    """The shares of some names over time, as SVG."""
    lines = "".join(
        _curve(samples, name, colour, max(seconds, 1e-6))
        for name, colour in zip(names, CANDIDATE_COLOURS, strict=False)
    )
    told = escape(f"Share of the votes over time for {', '.join(names)}", quote=True)
    return (
        f'<svg viewBox="0 0 1000 {CURVE_HEIGHT}" preserveAspectRatio="none" width="100%" '
        f'height="{CURVE_HEIGHT}" role="img" aria-label="{told}">{lines}</svg>'
    )


def _curve(
    samples: Sequence[tuple[float, Mapping[str, float]]], name: str, colour: str, seconds: float
) -> str:
    points = " ".join(
        f"{1000 * time / seconds:.1f},{(1 - shares.get(name, 0.0)) * (CURVE_HEIGHT - 4) + 2:.1f}"
        for time, shares in samples
    )
    return (
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2" '
        'vector-effect="non-scaling-stroke"/>'
    )
