"""The picture of a run with its overlays: zones, trails, relations and the clicked object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from nicegui import background_tasks, run, ui
from nicegui.events import GenericEventArguments

from visup.agent import Mind
from visup.agent.model.errors import VisupError
from visup.console.drawing.overlay_svg import RelationVector, overlay_svg, vectors_of
from visup.console.pages.frame import shown_text
from visup.console.pages.playhead import Playhead
from visup.console.state import ConsoleState

POINTED = (
    "(e) => { const s = e.currentTarget.querySelector('svg'); if (!s) return;"
    " const p = new DOMPoint(e.clientX, e.clientY).matrixTransform(s.getScreenCTM().inverse());"
    " emit([p.x, p.y]); }"
)


@dataclass(slots=True)
class ShownLayers:
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
        self._layers = ShownLayers()
        self._vectors: tuple[int, Sequence[RelationVector]] = (-1, ())
        self._busy = False
        with ui.element("div").classes("stage-picture") as place:
            self._image = ui.element("img").classes("picture")
            self._image.props["alt"] = "The frame with what is believed drawn over it"
            self._over = ui.html("", sanitize=False).classes("over")
        place.on("click", self._pointed, js_handler=POINTED)
        self._switches()
        head.listen(self._show)
        self._show()

    def _switches(self) -> None:
        has_zones = bool(self._head.run.zones)
        with ui.row().classes("gap-3 items-center layers"):
            self._switch("contours", "plain", turned=True)
            self._switch("relations", "relations")
            self._switch("trails", "trails")
            if has_zones:
                self._switch("zones", "zones")
            self._said = ui.label().classes("dim")
        if self._head.run.pictures.problem:
            ui.label(shown_text(self._head.run.pictures.problem)).classes("dim")

    def _switch(self, words: str, layer: str, *, turned: bool = False) -> None:
        def changed(on: bool) -> None:
            setattr(self._layers, layer, on != turned)
            self._show()

        value = getattr(self._layers, layer) != turned
        box = ui.checkbox(words, value=value, on_change=lambda e: changed(bool(e.value)))
        box.props("dense size=xs")

    def _pointed(self, e: GenericEventArguments) -> None:
        x, y = (float(v) for v in e.args)
        self._head.point(x, y)

    def _show(self) -> None:
        plain = "?plain=1" if self._layers.plain else ""
        self._image.props["src"] = f"/picture/{self._key}/{self._head.number}.jpg{plain}"
        self._image.update()
        self._draw()
        if self._layers.relations and self._vectors[0] != self._head.number and not self._busy:
            background_tasks.create(self._relate())

    def _draw(self) -> None:
        head, layers = self._head, self._layers
        number, vectors = self._vectors
        try:
            mind = head.run.mind(head.number)
            trails: Mapping[int, Sequence[tuple[float, float]]] = (
                head.run.trails(head.number) if layers.trails else {}
            )
        except VisupError:
            return
        if not layers.zones:
            mind = replace(mind, zones=())
        shown = vectors if layers.relations and number == head.number else ()
        self._over.set_content(overlay_svg(mind, shown, trails, head.drawn, head.chosen))

    async def _relate(self) -> None:
        """Fetch the relations of the moment: they come from replayed reasoning, in the background."""
        self._busy = True
        self._said.set_text("" if self._vectors[0] >= 0 else "reasoning up to here ...")
        try:
            while self._layers.relations and self._vectors[0] != (number := self._head.number):
                mind = await run.io_bound(self._mind, number)
                self._vectors = number, vectors_of(mind) if mind else ()
            self._said.set_text("")
            self._draw()
        except VisupError as fault:
            self._said.set_text(shown_text(fault.what))
        finally:
            self._busy = False

    def _mind(self, number: int) -> Mind:
        return self._state.inquiry(self._key).mind(number + 1)
