"""The page of one run: picture, timeline, beliefs, events, and explanations."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import events, ui

from visup.agent.model.errors import OutputError, VisupError
from visup.console.access import ConsoleRole
from visup.console.drawing.timeline_svg import timeline_svg
from visup.console.pages.page_elements import icon_button, page_frame, safe_text, verdict_badge
from visup.console.pages.panels.ask_panel import ask_panel
from visup.console.pages.panels.belief_panel import belief_panel
from visup.console.pages.panels.events_panel import alerts_panel, events_panel
from visup.console.pages.panels.steps_panel import steps_panel
from visup.console.pages.panels.what_if_panel import what_if_panel
from visup.console.pages.panels.write_panel import write_panel
from visup.console.pages.picture import RunPicture
from visup.console.pages.playhead import SLIDER_STEP, SPEEDS, TICK_S, Playhead
from visup.console.pages.shortcuts import show_shortcuts
from visup.console.state import ConsoleState
from visup.console.tracks import TimelineTrack

REFRESH_S = 2.0
"""Interval of checks whether a live run has grown, seconds."""


def run_page(state: ConsoleState, key: str, role: ConsoleRole, start_s: float) -> None:
    """Lay out the page.

    Args:
        state: Shared state of all pages.
        key: Key of the run.
        role: Role of the user.
        start_s: Initial position, seconds.
    """
    try:
        run = state.view(key, refresh=True)
    except VisupError as fault:
        with page_frame("Run"):
            pass
        with ui.element("div").classes("card w-full"):
            ui.label(safe_text(fault.what if isinstance(fault, OutputError) else str(fault)))
            ui.link("All runs", "/").classes("brand")
        return
    head = Playhead(run)
    with page_frame(run.name):
        _verdict(head)
        icon_button("keyboard", "Keys (?)", show_shortcuts)
    if not run.frames:
        ui.label("Nothing has been processed in this run yet.").classes("card w-full")
        return
    with ui.element("div").classes("run-grid"):
        with ui.element("section").classes("card").props('aria-label="Picture and timeline"'):
            RunPicture(state, head, key)
            _controls(head)
            _timeline(head)
        with ui.element("section").classes("card").props('aria-label="What is believed"'):
            _tabs(state, head, key, role)
    _shortcuts(head)
    ui.timer(TICK_S, head.tick)
    head.go_to_time(start_s)
    if not run.ended:
        _follow(state, key, head)


def _verdict(head: Playhead) -> None:
    """The verdict of the run; that of a live one is there once it has ended."""

    @ui.refreshable
    def verdict() -> None:
        verdict_badge(head.run.verdict, ended=head.run.ended)

    verdict()
    head.listen_to_growth(lambda: verdict.refresh() if head.run.ended else None)


def _controls(head: Playhead) -> None:
    with ui.element("div").classes("controls").props('role=group aria-label="Playing"'):
        icon_button("first_page", "To the start", lambda: head.go(0))
        icon_button("skip_previous", "Previous event (p)", lambda: head.next_event(forward=False))
        icon_button("chevron_left", "One frame back (←)", lambda: head.step(-1))
        play = icon_button("play_arrow", "Play or pause (space)", head.toggle)
        icon_button("chevron_right", "One frame forward (→)", lambda: head.step(1))
        icon_button("skip_next", "Next event (n)", head.next_event)
        icon_button("last_page", "To the end", lambda: head.go(len(head.run.frames) - 1))
        speeds = {s: f"{s:g}×" for s in SPEEDS}
        ui.select(speeds, value=1.0, on_change=lambda e: setattr(head, "speed", e.value)).props(
            'dense borderless options-dense aria-label="Speed"'
        )
        where = ui.label().classes("time")
        frame = ui.label().classes("dim")

    def show() -> None:
        play.props(f"icon={'pause' if head.playing else 'play_arrow'}")
        run = head.run
        where.set_text(run.cursor_text(run.times[head.number]))
        frame.set_text(f"frame {run.frames[head.number]}")

    head.listen(show)
    show()


def _timeline(head: Playhead) -> None:
    """The timeline with the cursor; a click moves it."""
    with ui.element("div").classes("timeline"):
        ui.element("div")
        slider = ui.slider(min=0, max=1.0, step=SLIDER_STEP, value=0.0)
        slider.props('dense aria-label="Moment"').on(
            "update:model-value", lambda e: head.drag_to_share(float(e.args)), throttle=0.05
        )
        with ui.element("div").classes("labels").props("aria-hidden=true"):
            _track_labels(head)
        with ui.element("div").classes("bars") as bars:
            drawing = ui.html("", sanitize=False)
            cursor = ui.element("div").classes("cursor")
    bars.on(
        "click",
        lambda e: head.go_to_share(float(e.args)),
        js_handler="(e) => { const r = e.currentTarget.getBoundingClientRect();"
        " emit((e.clientX - r.left) / Math.max(1, r.width)); }",
    )

    def show() -> None:
        share = head.run.share(head.run.times[head.number])
        cursor.style(f"left:{100 * share:.3f}%")
        slider.set_value(round(share, 3))

    def draw() -> None:
        run = head.run
        drawing.set_content(timeline_svg(run.tracks, run.seconds, run.start))

    head.listen(show)
    head.listen_to_growth(draw)
    draw()
    show()


def _track_labels(head: Playhead) -> None:
    """The names of the rows of the timeline; a live run gets new ones."""
    shown: list[TimelineTrack] = []

    @ui.refreshable
    def labels() -> None:
        for track in shown:
            ui.label(safe_text(track.label)).props(f'title="{track.group}"')

    def grown() -> None:
        now = list(head.run.tracks)
        if [(t.group, t.label) for t in now] != [(t.group, t.label) for t in shown]:
            shown[:] = now
            labels.refresh()

    shown[:] = head.run.tracks
    labels()
    head.listen_to_growth(grown)


def _tabs(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    names = ("Now", "Events", "Alerts", "Ask", "Steps", "What if", "Write")
    head.panel = names[0]
    with ui.tabs().props("dense align=left no-caps") as tabs:
        elements = {name: ui.tab(name) for name in names}
    with ui.tab_panels(tabs, value=elements["Now"], animated=False).classes("w-full"):
        with ui.tab_panel(elements["Now"]):
            belief_panel(state, head, key, role)
        with ui.tab_panel(elements["Events"]):
            events_panel(head)
        with ui.tab_panel(elements["Alerts"]):
            alerts_panel(head, key, role)
        with ui.tab_panel(elements["Ask"]):
            ask_panel(state, head, key)
        with ui.tab_panel(elements["Steps"]):
            steps_panel(state, head, key)
        with ui.tab_panel(elements["What if"]):
            what_if_panel(state, head, key, role)
        with ui.tab_panel(elements["Write"]):
            write_panel(state, head, key, role)
    tabs.on_value_change(lambda e: head.open_panel(str(e.value)))


def _shortcuts(head: Playhead) -> None:
    """Keyboard shortcuts."""

    def pressed(e: events.KeyEventArguments) -> None:
        if not e.action.keydown or e.modifiers.ctrl or e.modifiers.alt or e.modifiers.meta:
            return
        step = 10 if e.modifiers.shift else 1
        actions: dict[str, Callable[[], object]] = {
            " ": head.toggle,
            "ArrowLeft": lambda: head.step(-step),
            "ArrowRight": lambda: head.step(step),
            "Home": lambda: head.go(0),
            "End": lambda: head.go(len(head.run.frames) - 1),
            "n": head.next_event,
            "p": lambda: head.next_event(forward=False),
            "?": show_shortcuts,
        }
        if action := actions.get(str(e.key)):
            action()

    ui.keyboard(on_key=pressed, ignore=["input", "select", "button", "textarea"])


def _follow(state: ConsoleState, key: str, head: Playhead) -> None:
    """Refresh a live run, and stay at its end if the cursor is there."""

    def refresh() -> None:
        try:
            grown = state.view(key, refresh=True)
        except VisupError:
            return
        if grown is not head.run:
            head.grow(grown)
        if grown.ended:
            timer.cancel()

    timer = ui.timer(REFRESH_S, refresh)
