"""What-if analysis: a changed belief from the cursor on, compared with the run."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import run, ui

from visup.agent.model.errors import VisupError
from visup.console.access import ConsoleRole
from visup.console.pages.page_elements import safe_text, text_button
from visup.console.pages.playhead import Playhead
from visup.console.reasoning.inquiry import BranchComparison
from visup.console.state import ConsoleState
from visup.wording import prose

EXAMPLE = "object 2 satellite, touching 1 2 false, object 1 hidden"
MAX_LINES = 200


def what_if_panel(state: ConsoleState, head: Playhead, key: str, role: ConsoleRole) -> None:
    """Lay out the panel."""
    if role is not ConsoleRole.OPERATOR:
        ui.label("Read-only access: you cannot try things out.").classes("dim")
        return
    steps = len(head.run.frames)

    async def try_assumption(what: str, number: int) -> None:
        await show_comparison(lambda: state.inquiry(key).what_if(number, what, steps), output, head)

    _assumption_input(try_assumption, head)
    with (
        ui.element("div")
        .classes("scroll")
        .props('tabindex=0 role=region aria-label="What would differ"')
    ):
        output = ui.column().classes("w-full gap-0")


def _assumption_input(on_try: Callable[[str, int], Awaitable[None]], head: Playhead) -> None:
    ui.label("What if, from the cursor on?").classes("dim")
    with ui.row().classes("w-full items-center no-wrap"):
        assumption = ui.input(placeholder=EXAMPLE).props(
            'dense outlined aria-label="What is assumed"'
        )
        assumption.classes("grow")
        text_button(
            "Try", lambda: on_try(str(assumption.value or ""), head.number + 1), primary=True
        )


async def show_comparison(
    compare: Callable[[], BranchComparison],
    output: ui.element,
    head: Playhead,
    *,
    show_assumption: bool = False,
) -> None:
    """Compute an alternative course in the background, and show it or the reason for its failure.

    Args:
        compare: Computes it.
        output: Element for the result.
        head: The cursor.
        show_assumption: Whether to show the assumption.
    """
    output.clear()
    with output:
        ui.spinner(size="md")
    comparison, problem = None, ""
    try:
        comparison = await run.io_bound(compare)
    except VisupError as fault:
        problem = str(fault)
    if output.is_deleted:  # the page was closed meanwhile
        return
    output.clear()
    with output:
        if comparison is not None:
            if show_assumption:
                ui.label(safe_text(comparison.assumption)).classes("dim")
            _show_differences(comparison, head)
        elif problem:  # with neither, the console is stopping
            ui.label(safe_text(problem)).classes("why")


def _show_differences(comparison: BranchComparison, head: Playhead) -> None:
    """Show the events of both timelines side by side."""
    actual, alternative = (v or "none" for v in comparison.differences.verdicts)
    verdicts = (
        f"verdict: {actual}" if actual == alternative else f"verdict: {actual} → {alternative}"
    )
    ui.label(verdicts.replace("_", " ")).style("font-weight:600")
    if not comparison.differences:
        ui.label(f"No other events, up to {head.run.time_text(comparison.end)}.").classes("dim")
    marked = [("−", e) for e in comparison.differences.gone] + [
        ("+", e) for e in comparison.differences.new
    ]
    marked.sort(key=lambda m: float(m[1].get("time", 0.0)))
    for mark, event in marked[:MAX_LINES]:
        time = float(event.get("time", 0.0))
        with ui.element("div").classes("line"):
            ui.label(mark).classes("when")
            ui.label(head.run.time_text(time)).classes("when")
            with ui.element("button").classes("plain said") as button:
                ui.label(safe_text(prose(str(event.get("text", "")))))
            button.on("click", lambda t=time: head.go_to_time(t))
