"""An alert on a page: time, text, picture, clip and feedback."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from nicegui import ui

from visup.agent import Alert
from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.evidence import evidence_of
from visup.console.feedback import AlertFeedback, Opinion, store_feedback
from visup.console.pages.page_elements import safe_text, text_button
from visup.console.run_view import RunView
from visup.wording import prose


@dataclass(frozen=True, slots=True)
class AlertRow:
    """One alert and its run.

    Attributes:
        key: Key of its run.
        run: Its run.
        alert: The alert.
        feedback: The latest feedback, or None.
        camera: Name of its camera; empty if that is clear.
    """

    key: str
    run: RunView
    alert: Alert
    feedback: AlertFeedback | None
    camera: str = ""


def show_alert(
    row: AlertRow, role: ConsoleRole, on_open: Callable[[], object], refresh: Callable[[], object]
) -> None:
    """Lay out a row.

    Args:
        row: The alert.
        role: Role of the user; only operators may give feedback.
        on_open: Moves the cursor to the alert.
        refresh: Redraws all rows.
    """
    with ui.element("div").classes("alert"):
        _thumbnail(row)
        with ui.element("div").classes("alert-words"):
            with ui.element("div").classes(f"line {row.alert.severity.name.lower()}"):
                ui.label(row.run.time_text(row.alert.opened)).classes("when")
                with ui.element("button").classes("plain said") as button:
                    ui.label(safe_text(prose(row.alert.cause)))
                button.on("click", on_open)
            _details(row, role, refresh)


def _details(row: AlertRow, role: ConsoleRole, refresh: Callable[[], object]) -> None:
    """Objects, duration, feedback so far, and buttons for feedback."""
    alert = row.alert
    until = "still open" if alert.closed is None else f"until {row.run.time_text(alert.closed)}"
    facts = [row.camera, alert.kind.replace("_", " "), until]
    with ui.row().classes("items-center gap-2 under-line"):
        ui.label(safe_text(", ".join(filter(None, facts)))).classes("dim")
        if row.feedback:
            note = f": {row.feedback.note}" if row.feedback.note else ""
            ui.label(safe_text(f"{row.feedback.opinion.value}{note}")).classes("dim opinion")
        if role is ConsoleRole.OPERATOR:
            _feedback_buttons(row, refresh)


def _thumbnail(row: AlertRow) -> None:
    """A thumbnail; a click shows the picture and the clip."""
    if not evidence_of(row.run.folder, row.alert.id).snapshot:
        return
    button = ui.element("button").classes("plain evidence")
    button.props["aria-label"] = f"picture and clip of alert {row.alert.id}"
    button.on("click", partial(_show_evidence, row))
    with button:
        picture = ui.element("img").props('alt="" loading=lazy')
        picture.props["src"] = f"/evidence/{row.key}/{row.alert.id}.jpg"


def _show_evidence(row: AlertRow) -> None:
    evidence = evidence_of(row.run.folder, row.alert.id)
    url = f"/evidence/{row.key}/{row.alert.id}"
    with ui.dialog() as dialog, ui.card().classes("card evidence-large"):
        ui.label(safe_text(f"{row.run.time_text(row.alert.opened)}  {prose(row.alert.cause)}"))
        if evidence.clip:
            video = ui.element("video").props(
                "controls autoplay muted playsinline preload=metadata"
            )
            video.props["src"], video.props["poster"] = f"{url}.webm", f"{url}.jpg"
            video.props["aria-label"] = "Clip of the alert"
        if evidence.snapshot:
            picture = ui.element("img")
            picture.props["src"] = f"{url}.jpg"
            picture.props["alt"] = "The picture when the alert was opened"
        if evidence.clip_pending:
            ui.label("The clip is still being made.").classes("dim")
        text_button("Close", dialog.close, primary=True)
    dialog.open()


def _feedback_buttons(row: AlertRow, refresh: Callable[[], object]) -> None:
    """The feedback buttons of an operator."""

    def store(opinion: Opinion, note: str = "") -> None:
        try:
            store_feedback(row.run.folder, row.alert, opinion, note)
        except VisupError as fault:
            ui.notify(safe_text(str(fault)), type="negative", multi_line=True)
            return
        refresh()

    for opinion in (Opinion.SEEN, Opinion.RIGHT, Opinion.FALSE_ALARM):
        text_button(opinion.value, partial(store, opinion))
    text_button("mute…", lambda: _mute(store)).tooltip("needs a reason")


def _mute(store: Callable[[Opinion, str], None]) -> None:
    """Ask for the reason."""
    with ui.dialog() as dialog, ui.card():
        ui.label("Why is it muted?")
        reason = ui.input("Reason").props("autofocus")

        def done() -> None:
            dialog.close()
            store(Opinion.MUTED, str(reason.value or ""))

        text_button("Mute", done, primary=True)
    dialog.open()
