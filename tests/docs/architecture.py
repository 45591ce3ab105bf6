"""The pictures of docs/architecture.md, drawn from the code.

`python -m tests.docs.architecture` draws them anew.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import grimp
import networkx as nx

from tests.paths import ROOT
from visup.runs.demo import demo_settings
from visup.runs.wiring import build_agent

if TYPE_CHECKING:
    from visup.agent.cycle.agent import Agent

IMAGES = ROOT / "docs" / "images"
WIDTH, PAD, LINE = 1100, 16, 17
STYLE = (
    "text{font:13px system-ui,sans-serif;fill:#1d2b33}.name{font-weight:600;font-size:14px}"
    ".small{font-size:11.5px;fill:#51646e}.band{fill:#eef3f5}.box{fill:#fff;stroke:#7d98a5}"
    ".arrow{stroke:#9db4bf;fill:none;stroke-width:1.3;marker-end:url(#head)}"
)
HEAD = (
    '<marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" markerHeight="6" '
    'orient="auto"><path d="M0 0L8 4L0 8z" fill="#9db4bf"/></marker>'
)

Parts = list[tuple[str, list[tuple[str, str]]]]
"""A part of the way -> what works there: name and where it is found."""


@dataclass(frozen=True, slots=True)
class Box:
    """A box with text; x, y, width and height in units of the picture."""

    name: str
    lines: tuple[str, ...]
    x: float
    y: float
    width: float
    height: float


def layers() -> list[list[str]]:
    """The rooms of the package from top to bottom, as the contract for imports orders them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    (whole,) = (c for c in contracts if c.get("containers") == ["visup"])
    return [re.findall(r"\w+", layer) for layer in whole["layers"] if layer != "__main__"]


def uses() -> list[tuple[str, str]]:
    """Which room imports which, without what follows from other arrows."""
    graph = grimp.build_graph("visup")
    rooms = {name.removeprefix("visup."): name for name in graph.find_children("visup")}
    rooms.pop("__main__", None)  # only calls `cli`
    arrows = nx.DiGraph()
    for a, whole_a in rooms.items():
        below = graph.find_modules_directly_imported_by
        inside = {whole_a, *graph.find_descendants(whole_a)}
        found = {m.split(".")[1] for one in inside for m in below(one) if m.count(".")}
        arrows.add_edges_from((a, b) for b in found if b != a)
    return sorted(nx.transitive_reduction(arrows).edges)


def about(room: str) -> tuple[str, tuple[str, ...]]:
    """What a room says of itself in its first words, and the rooms inside it."""
    folder = ROOT / "visup" / room
    file = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    doc = ast.get_docstring(ast.parse(file.read_text())) or ""
    inside = sorted(p.parent.name for p in folder.glob("*/__init__.py"))
    first = re.split(r"(?<=[.])\s", doc)[0].replace("`", "").rstrip(".")
    text = re.sub(r"^[\w ]{1,25}: ", "", first)
    return text[:1].upper() + text[1:], tuple(inside)


def wrapped(text: str, width: float, size: float = 6.1) -> tuple[str, ...]:
    """Text as lines that fit into a width."""
    return tuple(part for line in text.split("\n") for part in wrap(line, int(width / size)))


def row(named: Sequence[tuple[str, str]], y: float, left: float = PAD) -> list[Box]:
    """Boxes side by side over the whole width, as high as the highest."""
    width = (WIDTH - left - PAD * len(named)) / len(named)
    told = [wrapped(text, width - 2 * PAD) for _, text in named]
    height = LINE * (max(map(len, told)) + 1) + 14
    return [
        Box(name, lines, left + i * (width + PAD), y, width, height)
        for i, ((name, _), lines) in enumerate(zip(named, told, strict=True))
    ]


def svg(body: Iterable[str], height: float, title: str) -> str:
    """A whole picture."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height:.0f}" role="img">'
        f"<title>{escape(title)}</title><style>{STYLE}</style><defs>{HEAD}</defs>"
        f'<rect width="{WIDTH}" height="{height:.0f}" rx="10" fill="#fff"/>\n'
        + "\n".join(body)
        + "\n</svg>\n"
    )


def drawn(box: Box) -> str:
    """A box with its name and lines."""
    x, y = box.x + 10, box.y + 20
    lines = "".join(
        f'<text class="small" x="{x:.0f}" y="{y + LINE * (i + 1):.0f}">{escape(line)}</text>'
        for i, line in enumerate(box.lines)
    )
    return (
        f'<rect class="box" x="{box.x:.0f}" y="{box.y:.0f}" width="{box.width:.0f}" '
        f'height="{box.height:.0f}" rx="6"/>'
        f'<text class="name" x="{x:.0f}" y="{y:.0f}">{escape(box.name)}</text>{lines}'
    )


def rooms() -> str:
    """The rooms of the package: each may import from those below it."""
    boxes: list[Box] = []
    y, arrows = float(PAD), uses()
    for layer in layers():
        boxes += row([(name, _told(name, arrows)) for name in layer], y)
        y = boxes[-1].y + boxes[-1].height + 10
    return svg(map(drawn, boxes), y + 6, "The rooms of visup")


def _told(room: str, arrows: list[tuple[str, str]]) -> str:
    text, inside = about(room)
    below = [b for a, b in arrows if a == room]
    told = (f"{text}.", f"Inside: {', '.join(inside)}." if inside else "")
    return "\n".join(
        (*filter(None, told), f"\u2193 {', '.join(below)}" if below else "\u2193 nothing")
    )


def parts_of(agent: Agent) -> Parts:
    """The phases of a step in order, each with what works in it: its name and its module."""
    seeing = [
        (b.contract.name, f"{_home(type(b))}: {', '.join(b.contract.gives)}")
        for b in agent.behaviours
    ]
    thinking = [
        (phase.value, [(_name(r), _home(r)) for r in reasoners])
        for phase, reasoners in agent.reasoners.by_phase()
    ]
    acting = [
        ("alerts", "agent.cycle.alerts"),
        ("directives", "to the behaviours, at the next frame"),
    ]
    return [("perceive", seeing), *thinking, ("act", acting)]


def _name(part: object) -> str:
    name: str = getattr(part, "__name__", type(part).__name__)
    return name


def _home(part: object) -> str:
    return str(getattr(part, "__module__", "")).removeprefix("visup.")


def frame() -> str:
    """A frame's way through the agent of the demo."""
    agent = build_agent(demo_settings())
    given: list[tuple[str, list[tuple[str, str]]]] = [
        ("source", [("Frame", "percepts.video: image, index, time")])
    ]
    told = [
        ("observers", [("journal", "runs.recorder"), ("narrative", "terminal.narrator")]),
    ]
    body, y = [], float(PAD)
    for title, parts in [*given, *parts_of(agent), *told]:
        rows: list[Box] = []
        top = y
        for i in range(0, max(len(parts), 1), 4):
            rows += row(parts[i : i + 4], y + 8, 150) if parts else []
            y = (rows[-1].y + rows[-1].height if rows else y + 40) + 4
        body.append(
            f'<rect class="band" x="{PAD}" y="{top:.0f}" width="{WIDTH - 2 * PAD}" '
            f'height="{y - top + 6:.0f}" rx="8"/>'
            f'<text class="name" x="{PAD + 14}" y="{top + 28:.0f}">{escape(title)}</text>'
        )
        body += map(drawn, rows)
        y += 24
        body.append(f'<path class="arrow" d="M70 {y - 18:.0f}L70 {y - 2:.0f}"/>')
    agent.close()
    return svg(body[:-1], y, "A frame's way through visup")


def pictures() -> dict[Path, str]:
    """Files of the page and what should stand in them."""
    return {IMAGES / "rooms.svg": rooms(), IMAGES / "frame.svg": frame()}


if __name__ == "__main__":
    for path, text in pictures().items():
        path.write_text(text)
        print(path)
