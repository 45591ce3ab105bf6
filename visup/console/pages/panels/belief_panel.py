"""Beliefs at the cursor: tasks with their stages, objects, and the identity of the chosen object."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from visup.agent import Mind, ObjectBelief, Presence, TaskBelief
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.drawing.flow_svg import flow_svg, percent
from visup.console.pages.page_elements import (
    NEUTRAL_COLOUR,
    VERDICT_COLOURS,
    badge,
    safe_text,
    section_heading,
)
from visup.console.pages.panels.object_panel import Samples, show_object
from visup.console.pages.panels.questions_panel import QuestionsSection
from visup.console.pages.panels.teach_section import teach_section
from visup.console.pages.playhead import Playhead
from visup.console.state import ConsoleState
from visup.report.palette import STATUS_COLOURS, css, object_colour
from visup.rules.wording.sentences import role_or_model, spaced

MAX_OBJECTS = 30


def belief_panel(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the panel; it follows the cursor."""
    QuestionsSection(state, head, key, role)
    cached_samples: dict[tuple[int, int], Samples] = {}

    @ui.refreshable
    def beliefs() -> None:
        try:
            mind = head.run.mind(head.number)
        except VisupError as fault:
            ui.label(safe_text(str(fault)))
            return
        _health(mind)
        for task in mind.tasks:
            _task(task, head)
        _objects(mind, head)

    @ui.refreshable
    def identity() -> None:
        if (number := head.selected) is not None:
            cache_key = number, len(head.run.frames)
            if cache_key not in cached_samples:
                cached_samples.clear()
                cached_samples[cache_key] = list(head.run.identity_shares(number))
            show_object(head, key, number, cached_samples[cache_key])
            if role is ConsoleRole.OPERATOR and state.save_to is not None:
                teach_section(head, number, state.save_to)

    beliefs()
    identity()
    head.listen(beliefs.refresh, "Now")
    head.listen(identity.refresh, "Now")


def _health(mind: Mind) -> None:
    if mind.health.status.value != "ok":
        with ui.element("div").classes("line critical"):
            status = mind.health.status.value.replace("_", " ")
            ui.label(f"camera: {status}  {safe_text(mind.health.detail)}").classes("said")
    if mind.unknown:
        ui.label(f"not observed now: {', '.join(sorted(mind.unknown))}").classes("dim")


def _task(task: TaskBelief, head: Playhead) -> None:
    section_heading(f"Task {safe_text(task.task)}")
    verdict = task.verdict.value
    with ui.row().classes("gap-2 items-center"):
        badge(verdict.replace("_", " "), VERDICT_COLOURS.get(verdict, NEUTRAL_COLOUR))
        if task.success is not None and verdict == "in_progress":
            ui.label(f"probability of success: {percent(task.success)}").classes("dim")
    flow = head.run.flows.get(task.task)
    if flow is not None:
        with (
            ui.element("div")
            .classes("flow-place")
            .props('tabindex=0 role=region aria-label="Course of the task"')
        ):
            ui.html(flow_svg(flow, task), sanitize=False)
        return
    for stage in task.stages:
        is_current = stage.stage == task.current
        with ui.element("div").classes("line now" if is_current else "line"):
            ui.element("span").classes("swatch").style(
                f"background:{css(STATUS_COLOURS[stage.status])}"
            )
            ui.label(safe_text(stage.stage)).classes("said")
            ui.label(stage.status.value).classes("dim")


def _objects(mind: Mind, head: Playhead) -> None:
    found = sorted(mind.present(), key=lambda b: b.id)[:MAX_OBJECTS]
    section_heading("In view" if found else "Nothing is in view")
    for belief in found:
        with ui.element("div").classes("line now" if belief.id == head.selected else "line"):
            colour = css(object_colour(belief.id))
            ui.element("span").classes("swatch").style(f"background:{colour}")
            name = ui.element("button").classes("plain said")
            name.props["aria-label"] = f"identity of object {belief.id}"
            name.on("click", partial(head.select, belief.id))
            with name:
                ui.label(_label(belief, mind))
            ui.label(_certainty(belief)).classes("dim")


def _label(belief: ObjectBelief, mind: Mind) -> str:
    name = spaced(role_or_model(mind, belief.name)) if belief.candidates else "not identified"
    return safe_text(f"{belief.id}  {name}")


def _certainty(belief: ObjectBelief) -> str:
    share = percent(belief.strength) if belief.candidates else ""
    return share if belief.presence is Presence.SEEN else f"{belief.presence.value}  {share}"
