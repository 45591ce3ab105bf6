"""`visup doctor`: what is installed, what is missing, and whether the parts work."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import typer

CORE = (
    "numpy",
    "scipy",
    "opencv-python-headless",
    "scikit-image",
    "networkx",
    "lark",
    "pydantic",
    "rich",
    "typer",
    "prompt_toolkit",
)
EXTRAS = {
    "report": ("plotly",),
    "render": ("trimesh", "embreex"),
    "eval": ("motmetrics", "mahotas", "pyefd"),
    "onnx": ("onnxruntime",),
}


@dataclass(frozen=True, slots=True)
class CheckedPart:
    """One line of the doctor's list.

    Attributes:
        what: What was looked at.
        state: 'ok', 'missing' (of an extra: no fault) or 'broken'.
        detail: A version, or what to do.
    """

    what: str
    state: str
    detail: str


def doctor() -> None:
    """Show what is installed, what is missing, and versions. Exit code 2 when the core is broken."""
    from rich.console import Console
    from rich.table import Table

    findings = list(examine())
    table = Table("part", "state", "detail", title="visup doctor", title_justify="left")
    styles = {"ok": "green", "missing": "yellow", "broken": "bold red"}
    for f in findings:
        table.add_row(f.what, f"[{styles[f.state]}]{f.state}[/]", f.detail)
    Console().print(table)
    if any(f.state == "broken" for f in findings):
        raise typer.Exit(2)


def examine() -> Iterator[CheckedPart]:
    """Look at Python, the libraries, the extras, the codecs and the shipped files."""
    import platform

    from visup.version import __version__

    yield CheckedPart("visup", "ok", __version__)
    yield CheckedPart("Python", "ok", platform.python_version())
    for name in CORE:
        yield _library(name, None)
    for extra, names in EXTRAS.items():
        for name in names:
            yield _library(name, extra)
    yield _tried("video codecs", _codecs)
    yield _tried("behaviours", _behaviours)
    yield _tried("shipped tasks", _tasks)
    yield _tried("demo clip", _demo)


def _library(name: str, extra: str | None) -> CheckedPart:
    from importlib.metadata import PackageNotFoundError, version

    label = f"{name} ({extra})" if extra else name
    try:
        return CheckedPart(label, "ok", version(name))
    except PackageNotFoundError:
        if extra:
            return CheckedPart(label, "missing", f"pip install 'visup[{extra}]'")
        return CheckedPart(label, "broken", f"pip install {name}")


def _tried(what: str, look: Callable[[], str]) -> CheckedPart:
    """What a look says; whatever it raises is a finding, since finding faults is its purpose."""
    try:
        return CheckedPart(what, "ok", look())
    except Exception as fault:
        return CheckedPart(what, "broken", f"{type(fault).__name__}: {fault}")


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
