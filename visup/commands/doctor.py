"""`visup doctor`: what is installed, what is missing, and whether the parts work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated

import typer

from visup.terminal.console import echo, make_console

LIBRARIES = {
    "numpy": "arrays",
    "numba": "compiled loops",
    "scipy": "assignment, sparse systems, distances",
    "opencv-contrib-python-headless": "reading video, image processing",
    "networkx": "shock graphs and task graphs",
    "pillow": "pictures with text",
    "lark": "grammars of tasks and rules",
    "filelock": "one writer at a time for run folders and model databases",
    "pydantic": "settings and recorded files",
    "rich": "the terminal",
    "typer": "the command line",
    "prompt_toolkit": "the prompt of visup step",
    "urllib3": "alerts to a webhook",
}
"""The libraries that visup depends on, and their purpose; as `dependencies` in pyproject.toml."""

EXTRAS = {
    "report": ("the report of a run", ("plotly",)),
    "onnx": ("detectors as ONNX files (--detections)", ("onnxruntime",)),
    "render": ("visup render, models from meshes", ("trimesh", "embreex")),
    "lsp": ("visup task lsp: task files in editors", ("pygls",)),
    "eval": (
        "comparisons with other programs in visup eval",
        ("motmetrics", "mahotas", "pyefd", "rtamt"),
    ),
    "mqtt": ("alerts to an MQTT broker", ("paho-mqtt",)),
    "otel": (
        "traces and metrics for OpenTelemetry",
        ("opentelemetry-sdk", "opentelemetry-exporter-otlp-proto-http"),
    ),
    "ros": ("the pictures of ROS 2 bags", ("rosbags",)),
    "rerun": ("the Rerun viewer", ("rerun-sdk",)),
    "tables": ("runs as pandas and Arrow tables", ("pandas", "pyarrow")),
    "serve": (
        "visup serve: mail, chat, and figures for Prometheus",
        ("apprise", "prometheus-client"),
    ),
    "console": ("visup console: runs in the browser", ("nicegui",)),
    "cluster": (
        "visup archive: tables of many runs",
        ("distributed", "duckdb", "fsspec", "pyarrow"),
    ),
    "docs": ("building the documentation", ("mkdocs-material", "mkdocstrings")),
}
"""Purpose and libraries of each extra; as `optional-dependencies` in pyproject.toml."""


@dataclass(frozen=True, slots=True)
class CheckedPart:
    """One line of the report.

    Attributes:
        what: The part.
        state: 'ok', 'missing' (of an extra: no fault) or 'broken'.
        detail: A version, or what to do.
        purpose: What it is for, unless that is obvious.
    """

    what: str
    state: str
    detail: str
    purpose: str = ""


def doctor(
    speed: Annotated[
        bool, typer.Option("--speed", help="Also measure frames per second on the shipped clip.")
    ] = False,
) -> None:
    """Show what is installed, what is missing, and versions. Exit code 2 if the core is broken."""
    from rich.table import Table
    from rich.text import Text

    parts = list(examine())
    table = Table(title="visup doctor", title_justify="left")
    for heading in ("part", "state", "detail", "for"):
        table.add_column(heading, overflow="fold")
    styles = {"ok": "green", "missing": "yellow", "broken": "bold red"}
    for p in parts:
        state = Text(p.state, styles[p.state])
        table.add_row(Text(p.what), state, Text(p.detail), Text(p.purpose))
    make_console().print(table)
    for line in speeds() if speed else ():
        echo(line)
    if any(p.state == "broken" for p in parts):
        raise typer.Exit(2)


def examine() -> Iterator[CheckedPart]:
    """Check Python, the libraries, the extras, the codecs and the shipped files."""
    import platform

    from visup.version import __version__

    yield CheckedPart("visup", "ok", __version__)
    yield CheckedPart("Python", "ok", platform.python_version())
    for name, purpose in LIBRARIES.items():
        yield _library(name, purpose)
    for extra, (purpose, names) in EXTRAS.items():
        yield _extra(extra, purpose, names)
    yield _checked_part("video codecs", _codecs)
    yield _checked_part("behaviours", _behaviours)
    yield _checked_part("shipped tasks", _tasks)
    yield _checked_part("demo clip", _demo)


SPEED_FRAMES = 60
"""Frames measured for each figure, without the first ones, during which loops are compiled."""


def speeds(frames: int = SPEED_FRAMES) -> Iterator[str]:
    """Frames per second on the shipped clip: motion only, with models and a task, and by preset.

    Args:
        frames: How many are measured.
    """
    from dataclasses import replace

    from visup.runs.demo import demo_settings
    from visup.runs.inputs.presets import PRESETS
    from visup.runs.inputs.speed import measured_speed

    demo = demo_settings(1)
    bare = replace(demo, tasks=(), models=None, actors={})
    tried = {"without a task": bare, "with models and a task": demo}
    tried |= {f"--preset {name}": replace(bare, preset=name) for name in PRESETS}
    yield "Frames a second on this machine, shipped clip (640 x 480, 25 a second):"
    for name, settings in tried.items():
        speed = measured_speed(settings, frames)
        # Compared as printed: "12.5 of 12.5: drops" would contradict itself.
        possible, wanted = round(speed.possible, 1), round(speed.wanted, 1)
        keeps = "keeps up with a camera" if possible >= wanted else "drops frames of a camera"
        yield f"  {name:24} {possible:5.1f} of {wanted:4.1f} that it asks for: {keeps}"


def _library(name: str, purpose: str) -> CheckedPart:
    version = _version(name)
    if version is None:
        return CheckedPart(name, "broken", f"pip install {name}", purpose)
    return CheckedPart(name, "ok", version, purpose)


def _extra(extra: str, purpose: str, names: tuple[str, ...]) -> CheckedPart:
    """An extra is installed when all its libraries are."""
    versions = {name: _version(name) for name in names}
    label = f"visup[{extra}]"
    if None in versions.values():
        return CheckedPart(label, "missing", f"pip install '{label}'", purpose)
    return CheckedPart(label, "ok", ", ".join(f"{n} {v}" for n, v in versions.items()), purpose)


def _version(name: str) -> str | None:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _checked_part(what: str, check: Callable[[], str]) -> CheckedPart:
    """The result of one check; any exception is a finding, since finding faults is the purpose."""
    try:
        return CheckedPart(what, "ok", check())
    except Exception as error:
        return CheckedPart(what, "broken", f"{type(error).__name__}: {error}")


def _codecs() -> str:
    import tempfile
    from pathlib import Path

    import numpy as np

    from visup.report.video import WebmWriter

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "probe.webm"
        writer = WebmWriter(path, 25.0)
        for _ in range(3):
            writer.write(np.zeros((48, 64, 3), np.uint8))
        writer.close()
        return f".webm is written ({path.stat().st_size} bytes for 3 frames)"


def _behaviours() -> str:
    from visup.agent.plugins.registry import discover_behaviours

    registry = discover_behaviours()
    for name in registry.names():
        registry.make(name)
    return ", ".join(registry.names())


def _tasks() -> str:
    from visup.tasks import load_task, shipped_tasks

    names = shipped_tasks()
    for name in names:
        load_task(name)
    return ", ".join(names)


def _demo() -> str:
    from visup.percepts.shape.database.model_database import ModelDatabase
    from visup.runs.demo import demo_settings
    from visup.runs.wiring import open_video

    settings = demo_settings()
    with open_video(settings) as source:
        next(iter(source))
    if settings.models is None:
        raise FileNotFoundError("the demo's model database")
    return f"{source.frame_count} frames, {len(ModelDatabase.open(settings.models).names())} models"
