"""The flow chart of a task with the beliefs about it: status and confidence of stages, likely successors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from html import escape

from visup.agent import StageBelief, Status, TaskBelief
from visup.console.drawing.flow_layout import LINE_HEIGHT, PADDING, FlowBox, FlowLayout, layout_of
from visup.report.palette import STATUS_COLOURS, css
from visup.tasks.tools.diagram import BEGIN, END, Flow, Node
from visup.wording import printable

LETTER_WIDTH = 6.4
"""Approximate width of a letter, in SVG units."""

MIN_LABELLED_WIDTH = 200.0
"""Least width of a box with room for a label beside the stage name."""

ArrowLabels = tuple[tuple[tuple[str, str], str], ...]
"""Arrows and their labels."""


def flow_svg(flow: Flow, belief: TaskBelief) -> str:
    """Draw a flow.

    Args:
        flow: Flow of the task.
        belief: Belief about the task.

    Returns:
        An SVG element with text; colours are set by the page.
    """
    layout = _layout(tuple(flow.nodes.items()), tuple(flow.edges.items()))
    probabilities = {p.stage: p.probability for p in belief.prospects}
    arrows = "".join(_arrow(layout, edge, label) for edge, label in flow.edges.items())
    marks = {s.stage: _mark(s, belief, probabilities) for s in belief.stages}
    boxes = "".join(
        _box(layout.boxes[number], node, marks.get(node.stage, UNMARKED))
        for number, node in flow.nodes.items()
    )
    return (
        f'<svg class="flow" viewBox="0 0 {layout.width:.0f} {layout.height:.0f}" role="img" '
        f'style="max-width:{layout.width:.0f}px" aria-label="{escape(flow_in_words(belief), quote=True)}">'
        f"{_ARROW_HEAD}{arrows}{_dots(layout, probabilities)}{boxes}</svg>"
    )


@dataclass(frozen=True, slots=True)
class StageMark:
    """How a box shows its stage.

    Attributes:
        css_class: CSS class: 'box', perhaps with 'here' or 'next'.
        colour: CSS colour.
        confidence: Confidence of its status, 0 to 1.
        label: Label at its right.
        title: Tooltip.
    """

    css_class: str = "box"
    colour: str = css(STATUS_COLOURS[Status.PENDING])
    confidence: float = 0.0
    label: str = ""
    title: str = ""


UNMARKED = StageMark()


def _mark(stage: StageBelief, belief: TaskBelief, probabilities: Mapping[str, float]) -> StageMark:
    colour, status = css(STATUS_COLOURS[stage.status]), stage.status.value
    confidence = _confidence_text(stage, belief)
    css_class, label = "box", "" if stage.status is Status.PENDING else f"{status}{confidence}"
    if stage.stage == belief.current:
        css_class = "box here"
    elif stage.stage in probabilities:
        css_class, label = "box next", f"next {percent(probabilities[stage.stage])}"
    title = f"{stage.stage}: {status}{confidence}"
    return StageMark(css_class, colour, stage.confidence, label, title)


def flow_in_words(belief: TaskBelief) -> str:
    """The flow chart as a text for screen readers."""
    stages = [f"{s.stage}: {s.status.value}{_confidence_text(s, belief)}" for s in belief.stages]
    prospects = [f"{p.stage or 'the end'} {percent(p.probability)}" for p in belief.prospects]
    parts = [*stages, *([f"may come next: {', '.join(prospects)}"] if prospects else [])]
    return "; ".join(parts)


def _confidence_text(stage: StageBelief, belief: TaskBelief) -> str:
    """The confidence of a status as text; empty for older journals and tasks that are not followed."""
    return "" if belief.success is None else f" {percent(stage.confidence)}"


def percent(share: float) -> str:
    """A share of 1, such as '82 %'."""
    return f"{share:.0%}".replace("%", " %")


@lru_cache(maxsize=64)
def _layout(nodes: tuple[tuple[str, Node], ...], edges: ArrowLabels) -> FlowLayout:
    return layout_of(Flow(dict(nodes), dict(edges)))


_ARROW_HEAD = (
    '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
    'orient="auto"><path class="head" d="M0,0 L8,4 L0,8 z"/></marker></defs>'
)


def _dots(layout: FlowLayout, probabilities: Mapping[str, float]) -> str:
    """The dots for the beginning, and for the end with its probability of being next."""
    parts = []
    for name, css_class in ((BEGIN, "begin"), (END, "end")):
        b = layout.boxes[name]
        x, y, r = b.x + b.width / 2, b.y + b.height / 2, b.width / 2
        parts.append(f'<circle class="{css_class}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>')
        if css_class == "end" and "" in probabilities:
            parts.append(
                f'<text class="likely" x="{x + r + 8:.1f}" y="{y + 4:.1f}">'
                f"next {percent(probabilities[''])}</text>"
            )
    return "".join(parts)


def _box(box: FlowBox, node: Node, mark: StageMark) -> str:
    rectangle = f'x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}"'
    confidence_bar = (
        f'<rect x="{box.x + 3:.1f}" y="{box.y + box.height - 6:.1f}" '
        f'width="{(box.width - 6) * mark.confidence:.1f}" height="3" fill="{mark.colour}"/>'
    )
    return (
        f'<g><title>{escape(printable(mark.title))}</title><rect class="{mark.css_class}" '
        f'{rectangle} rx="6"/>'
        f'<rect x="{box.x:.1f}" y="{box.y:.1f}" width="6" height="{box.height:.1f}" rx="3" '
        f'fill="{mark.colour}"/>{confidence_bar}{_lines(box, node)}{_label(box, mark)}</g>'
    )


def _lines(box: FlowBox, node: Node) -> str:
    max_letters = int((box.width - 22) / LETTER_WIDTH)
    rows = []
    for k, line in enumerate(node.lines):
        is_name = k == 0 and line.startswith("<")
        text = line.strip("<>").replace("_", " ") if is_name else line
        max_length = max_letters - 16 if is_name and box.width > MIN_LABELLED_WIDTH else max_letters
        text = text if len(text) <= max_length else text[: max(1, max_length - 1)] + "…"
        y = box.y + PADDING + LINE_HEIGHT * (k + 1) - 4
        css_class = "name" if is_name else "asked"
        rows.append(
            f'<text class="{css_class}" x="{box.x + 14:.1f}" y="{y:.1f}">{escape(printable(text))}</text>'
        )
    return "".join(rows)


def _label(box: FlowBox, mark: StageMark) -> str:
    """The label at the right: status with confidence, or probability of being next."""
    if box.width <= MIN_LABELLED_WIDTH or not mark.label:
        return ""
    css_class = "likely" if mark.css_class.endswith("next") else "sure"
    position = f'x="{box.x + box.width - 8:.1f}" y="{box.y + PADDING + LINE_HEIGHT - 4:.1f}"'
    return f'<text class="{css_class}" {position} text-anchor="end">{mark.label}</text>'


def _arrow(layout: FlowLayout, edge: tuple[str, str], label: str) -> str:
    a, b = layout.boxes[edge[0]], layout.boxes[edge[1]]
    if edge in layout.back_edges:
        path, position = _curve_around(a, b, a.x + a.width, b.x + b.width, 30.0)
    elif layout.rank[edge[1]] - layout.rank[edge[0]] > 1:
        path, position = _curve_around(a, b, a.x, b.x, -30.0)
    else:
        x, y, u, v = a.x + a.width / 2, a.y + a.height, b.x + b.width / 2, b.y
        path, position = (
            f"M{x:.1f},{y:.1f} L{u:.1f},{v - 1:.1f}",
            ((x + u) / 2 + 6, (y + v) / 2 + 4),
        )
    escaped = escape(printable(label))
    label_text = (
        f'<text class="asked" x="{position[0]:.1f}" y="{position[1]:.1f}">{escaped}</text>'
        if label
        else ""
    )
    css_class = "arrow back" if edge in layout.back_edges else "arrow"
    return f'<path class="{css_class}" d="{path}" marker-end="url(#head)"/>{label_text}'


def _curve_around(
    a: FlowBox, b: FlowBox, x: float, u: float, offset: float
) -> tuple[str, tuple[float, float]]:
    """A curve past the boxes between two boxes."""
    y, v = a.y + a.height / 2, b.y + b.height / 2
    turning_x = (max(x, u) if offset > 0 else min(x, u)) + offset
    return (
        f"M{x:.1f},{y:.1f} C{turning_x:.1f},{y:.1f} {turning_x:.1f},{v:.1f} {u:.1f},{v:.1f}",
        (turning_x - (30 if offset > 0 else -4), (y + v) / 2),
    )
