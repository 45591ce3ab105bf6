"""The picture of a run with its overlays: zones, trails, relations and the clicked object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from nicegui import background_tasks, run, ui
from nicegui.events import GenericEventArguments

from visup.agent import Mind
from visup.agent.model.errors import VisupError
from visup.console.drawing.overlay_svg import RelationLine, overlay_svg, relation_lines
from visup.console.pages.page_elements import safe_text
from visup.console.pages.playhead import Playhead
from visup.console.state import ConsoleState

CLICK_HANDLER = (
    "(e) => { const s = e.currentTarget.querySelector('svg'); if (!s) return;"
    " const p = new DOMPoint(e.clientX, e.clientY).matrixTransform(s.getScreenCTM().inverse());"
    " emit([p.x, p.y]); }"
)


@dataclass(slots=True)
class VisibleLayers:
    """The visible layers.

    Attributes:
        plain: The picture without contours and names.
        relations: Lines for relations.
        trails: Past positions of objects.
        zones: Zones.
    """

    plain: bool = False
    relations: bool = False
    trails: bool = False
    zones: bool = True


class RunPicture:
    """The frame at the cursor with the beliefs drawn over it.

    Args:
        state: Shared state of all pages.
        head: The cursor.
        key: Key of the run.
    """

    def __init__(self, state: ConsoleState, head: Playhead, key: str) -> None:
        self._state, self._head, self._key = state, head, key
        self._layers = VisibleLayers()
        self._relation_lines: tuple[int, Sequence[RelationLine]] = (-1, ())
        self._busy = False
        with ui.element("div").classes("stage-picture") as container:
            self._image = ui.element("img").classes("picture")
            self._image.props["alt"] = "The frame with what is believed drawn over it"
            self._overlay = ui.html("", sanitize=False).classes("over")
        container.on("click", self._clicked, js_handler=CLICK_HANDLER)
        self._switches()
        head.listen(self._show)
        self._show()

    def _switches(self) -> None:
        has_zones = bool(self._head.run.zones)
        with ui.row().classes("gap-3 items-center layers"):
            self._switch("contours", "plain", inverted=True)
            self._switch("relations", "relations")
            self._switch("trails", "trails")
            if has_zones:
                self._switch("zones", "zones")
            self._status = ui.label().classes("dim")
        if self._head.run.pictures.problem:
            ui.label(safe_text(self._head.run.pictures.problem)).classes("dim")

    def _switch(self, label: str, layer: str, *, inverted: bool = False) -> None:
        def changed(on: bool) -> None:
            setattr(self._layers, layer, on != inverted)
            self._show()

        value = getattr(self._layers, layer) != inverted
        box = ui.checkbox(label, value=value, on_change=lambda e: changed(bool(e.value)))
        box.props("dense size=xs")

    def _clicked(self, e: GenericEventArguments) -> None:
        x, y = (float(v) for v in e.args)
        self._head.click(x, y)

    def _show(self) -> None:
        plain = "?plain=1" if self._layers.plain else ""
        self._image.props["src"] = f"/picture/{self._key}/{self._head.number}.jpg{plain}"
        self._image.update()
        self._draw()
        if (
            self._layers.relations
            and self._relation_lines[0] != self._head.number
            and not self._busy
        ):
            background_tasks.create(self._load_relations())

    def _draw(self) -> None:
        head, layers = self._head, self._layers
        number, lines = self._relation_lines
        try:
            mind = head.run.mind(head.number)
            trails: Mapping[int, Sequence[tuple[float, float]]] = (
                head.run.trails(head.number) if layers.trails else {}
            )
        except VisupError:
            return
        if not layers.zones:
            mind = replace(mind, zones=())
        shown = lines if layers.relations and number == head.number else ()
        self._overlay.set_content(
            overlay_svg(mind, shown, trails, head.zone_corners, head.selected)
        )

    async def _load_relations(self) -> None:
        """Fetch the relations of the moment: they come from replayed reasoning, in the background."""
        self._busy = True
        self._status.set_text("" if self._relation_lines[0] >= 0 else "reasoning up to here ...")
        try:
            while self._layers.relations and self._relation_lines[0] != (
                number := self._head.number
            ):
                mind = await run.io_bound(self._mind, number)
                self._relation_lines = number, relation_lines(mind) if mind else ()
            self._status.set_text("")
            self._draw()
        except VisupError as fault:
            self._status.set_text(safe_text(fault.what))
        finally:
            self._busy = False

    def _mind(self, number: int) -> Mind:
        return self._state.inquiry(self._key).mind(number + 1)
