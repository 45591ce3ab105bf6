"""The flow chart of a task with the beliefs about it: status and confidence of stages, likely successors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from html import escape

from visup.agent import StageBelief, Status, TaskBelief
from visup.console.drawing.flow_layout import LINE, PAD, FlowBox, FlowLayout, layout_of
from visup.report.palette import STATUS_COLOURS, css
from visup.tasks.tools.diagram import BEGIN, END, Flow, Node
from visup.wording import printable

LETTER = 6.4
"""Approximate width of a letter, in SVG units."""

ROOMY = 200.0
"""Least width of a box with room for a label beside the stage name."""

Labels = tuple[tuple[tuple[str, str], str], ...]
"""Arrows and their labels."""


def flow_svg(flow: Flow, belief: TaskBelief) -> str:
    """Draw a flow.

    Args:
        flow: Flow of the task.
        belief: Belief about the task.

    Returns:
        An SVG element with text; colours are set by the page.
    """
    placed = _placed(tuple(flow.nodes.items()), tuple(flow.edges.items()))
    chances = {p.stage: p.probability for p in belief.prospects}
    arrows = "".join(_arrow(placed, edge, said) for edge, said in flow.edges.items())
    marks = {s.stage: _mark(s, belief, chances) for s in belief.stages}
    boxes = "".join(
        _box(placed.boxes[number], node, marks.get(node.stage, PLAIN))
        for number, node in flow.nodes.items()
    )
    return (
        f'<svg class="flow" viewBox="0 0 {placed.width:.0f} {placed.height:.0f}" role="img" '
        f'style="max-width:{placed.width:.0f}px" aria-label="{escape(flow_in_words(belief), quote=True)}">'
        f"{_HEAD}{arrows}{_dots(placed, chances)}{boxes}</svg>"
    )


@dataclass(frozen=True, slots=True)
class StageMark:
    """How a box shows its stage.

    Attributes:
        kind: CSS class: 'box', perhaps with 'here' or 'next'.
        colour: CSS colour.
        sure: Confidence of its status, 0 to 1.
        said: Label at its right.
        title: Tooltip.
    """

    kind: str = "box"
    colour: str = css(STATUS_COLOURS[Status.PENDING])
    sure: float = 0.0
    said: str = ""
    title: str = ""


PLAIN = StageMark()


def _mark(stage: StageBelief, belief: TaskBelief, chances: Mapping[str, float]) -> StageMark:
    colour, status = css(STATUS_COLOURS[stage.status]), stage.status.value
    sure = _sure(stage, belief)
    kind, said = "box", "" if stage.status is Status.PENDING else f"{status}{sure}"
    if stage.stage == belief.current:
        kind = "box here"
    elif stage.stage in chances:
        kind, said = "box next", f"next {percent(chances[stage.stage])}"
    title = f"{stage.stage}: {status}{sure}"
    return StageMark(kind, colour, stage.confidence, said, title)


def flow_in_words(belief: TaskBelief) -> str:
    """The flow chart as a text for screen readers."""
    stages = [f"{s.stage}: {s.status.value}{_sure(s, belief)}" for s in belief.stages]
    after = [f"{p.stage or 'the end'} {percent(p.probability)}" for p in belief.prospects]
    said = [*stages, *([f"may come next: {', '.join(after)}"] if after else [])]
    return "; ".join(said)


def _sure(stage: StageBelief, belief: TaskBelief) -> str:
    """The confidence of a status as text; empty for older journals and tasks that are not followed."""
    return "" if belief.success is None else f" {percent(stage.confidence)}"


def percent(share: float) -> str:
    """A share of 1, such as '82 %'."""
    return f"{share:.0%}".replace("%", " %")


@lru_cache(maxsize=64)
def _placed(nodes: tuple[tuple[str, Node], ...], edges: Labels) -> FlowLayout:
    return layout_of(Flow(dict(nodes), dict(edges)))


_HEAD = (
    '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
    'orient="auto"><path class="head" d="M0,0 L8,4 L0,8 z"/></marker></defs>'
)


def _dots(placed: FlowLayout, chances: Mapping[str, float]) -> str:
    """The dots for the beginning, and for the end with its probability of being next."""
    parts = []
    for name, kind in ((BEGIN, "begin"), (END, "end")):
        b = placed.boxes[name]
        x, y, r = b.x + b.width / 2, b.y + b.height / 2, b.width / 2
        parts.append(f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{r:.1f}"/>')
        if kind == "end" and "" in chances:
            parts.append(
                f'<text class="likely" x="{x + r + 8:.1f}" y="{y + 4:.1f}">'
                f"next {percent(chances[''])}</text>"
            )
    return "".join(parts)


def _box(box: FlowBox, node: Node, mark: StageMark) -> str:
    place = f'x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" height="{box.height:.1f}"'
    foot = (
        f'<rect x="{box.x + 3:.1f}" y="{box.y + box.height - 6:.1f}" '
        f'width="{(box.width - 6) * mark.sure:.1f}" height="3" fill="{mark.colour}"/>'
    )
    return (
        f'<g><title>{escape(printable(mark.title))}</title><rect class="{mark.kind}" {place} rx="6"/>'
        f'<rect x="{box.x:.1f}" y="{box.y:.1f}" width="6" height="{box.height:.1f}" rx="3" '
        f'fill="{mark.colour}"/>{foot}{_lines(box, node)}{_label(box, mark)}</g>'
    )


def _lines(box: FlowBox, node: Node) -> str:
    most = int((box.width - 22) / LETTER)
    rows = []
    for k, line in enumerate(node.lines):
        head = k == 0 and line.startswith("<")
        text = line.strip("<>").replace("_", " ") if head else line
        room = most - 16 if head and box.width > ROOMY else most
        text = text if len(text) <= room else text[: max(1, room - 1)] + "…"
        y = box.y + PAD + LINE * (k + 1) - 4
        kind = "name" if head else "asked"
        rows.append(
            f'<text class="{kind}" x="{box.x + 14:.1f}" y="{y:.1f}">{escape(printable(text))}</text>'
        )
    return "".join(rows)


def _label(box: FlowBox, mark: StageMark) -> str:
    """The label at the right: status with confidence, or probability of being next."""
    if box.width <= ROOMY or not mark.said:
        return ""
    kind = "likely" if mark.kind.endswith("next") else "sure"
    at = f'x="{box.x + box.width - 8:.1f}" y="{box.y + PAD + LINE - 4:.1f}"'
    return f'<text class="{kind}" {at} text-anchor="end">{mark.said}</text>'


def _arrow(placed: FlowLayout, edge: tuple[str, str], said: str) -> str:
    a, b = placed.boxes[edge[0]], placed.boxes[edge[1]]
    if edge in placed.back:
        path, at = _past(a, b, a.x + a.width, b.x + b.width, 30.0)
    elif placed.rank[edge[1]] - placed.rank[edge[0]] > 1:
        path, at = _past(a, b, a.x, b.x, -30.0)
    else:
        x, y, u, v = a.x + a.width / 2, a.y + a.height, b.x + b.width / 2, b.y
        path, at = f"M{x:.1f},{y:.1f} L{u:.1f},{v - 1:.1f}", ((x + u) / 2 + 6, (y + v) / 2 + 4)
    words = escape(printable(said))
    label = f'<text class="asked" x="{at[0]:.1f}" y="{at[1]:.1f}">{words}</text>' if said else ""
    kind = "arrow back" if edge in placed.back else "arrow"
    return f'<path class="{kind}" d="{path}" marker-end="url(#head)"/>{label}'


def _past(a: FlowBox, b: FlowBox, x: float, u: float, by: float) -> tuple[str, tuple[float, float]]:
    """A curve past the boxes between two boxes."""
    y, v = a.y + a.height / 2, b.y + b.height / 2
    far = (max(x, u) if by > 0 else min(x, u)) + by
    return (
        f"M{x:.1f},{y:.1f} C{far:.1f},{y:.1f} {far:.1f},{v:.1f} {u:.1f},{v:.1f}",
        (far - (30 if by > 0 else -4), (y + v) / 2),
    )
