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
from visup.console.feedback import AlertFeedback, Opinion, say
from visup.console.pages.frame import shown_text, worded_button
from visup.console.run_view import RunView
from visup.wording import prose


@dataclass(frozen=True, slots=True)
class AlertRow:
    """One alert and its run.

    Attributes:
        key: Key of its run.
        run: Its run.
        alert: The alert.
        said: The latest feedback, or None.
        camera: Name of its camera; empty if that is clear.
    """

    key: str
    run: RunView
    alert: Alert
    said: AlertFeedback | None
    camera: str = ""


def show_alert(
    row: AlertRow, role: ConsoleRole, go: Callable[[], object], again: Callable[[], object]
) -> None:
    """Lay out a row.

    Args:
        row: The alert.
        role: Role of the user; only operators may give feedback.
        go: Moves the cursor to the alert.
        again: Redraws all rows.
    """
    with ui.element("div").classes("alert"):
        _thumbnail(row)
        with ui.element("div").classes("alert-words"):
            with ui.element("div").classes(f"line {row.alert.severity.name.lower()}"):
                ui.label(row.run.when(row.alert.opened)).classes("when")
                with ui.element("button").classes("plain said") as button:
                    ui.label(shown_text(prose(row.alert.cause)))
                button.on("click", go)
            _below(row, role, again)


def _below(row: AlertRow, role: ConsoleRole, again: Callable[[], object]) -> None:
    """Objects, duration, feedback so far, and buttons for feedback."""
    alert = row.alert
    until = "still open" if alert.closed is None else f"until {row.run.when(alert.closed)}"
    facts = [row.camera, alert.kind.replace("_", " "), until]
    with ui.row().classes("items-center gap-2 under-line"):
        ui.label(shown_text(", ".join(filter(None, facts)))).classes("dim")
        if row.said:
            note = f": {row.said.note}" if row.said.note else ""
            ui.label(shown_text(f"{row.said.opinion.value}{note}")).classes("dim opinion")
        if role is ConsoleRole.OPERATOR:
            _opinions(row, again)


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
    place = f"/evidence/{row.key}/{row.alert.id}"
    with ui.dialog() as dialog, ui.card().classes("card evidence-large"):
        ui.label(shown_text(f"{row.run.when(row.alert.opened)}  {prose(row.alert.cause)}"))
        if evidence.clip:
            video = ui.element("video").props(
                "controls autoplay muted playsinline preload=metadata"
            )
            video.props["src"], video.props["poster"] = f"{place}.webm", f"{place}.jpg"
            video.props["aria-label"] = "Clip of the alert"
        if evidence.snapshot:
            picture = ui.element("img")
            picture.props["src"] = f"{place}.jpg"
            picture.props["alt"] = "The picture when the alert was opened"
        if evidence.awaited:
            ui.label("The clip is still being made.").classes("dim")
        worded_button("Close", dialog.close, main=True)
    dialog.open()


def _opinions(row: AlertRow, again: Callable[[], object]) -> None:
    """The feedback buttons of an operator."""

    def keep(opinion: Opinion, note: str = "") -> None:
        try:
            say(row.run.folder, row.alert, opinion, note)
        except VisupError as fault:
            ui.notify(shown_text(str(fault)), type="negative", multi_line=True)
            return
        again()

    for opinion in (Opinion.SEEN, Opinion.RIGHT, Opinion.FALSE_ALARM):
        worded_button(opinion.value, partial(keep, opinion))
    worded_button("mute…", lambda: _mute(keep)).tooltip("needs a reason")


def _mute(keep: Callable[[Opinion, str], None]) -> None:
    """Ask for the reason."""
    with ui.dialog() as dialog, ui.card():
        ui.label("Why is it muted?")
        reason = ui.input("Reason").props("autofocus")

        def done() -> None:
            dialog.close()
            keep(Opinion.MUTED, str(reason.value or ""))

        worded_button("Mute", done, main=True)
    dialog.open()
