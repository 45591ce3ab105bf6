"""The content of `visup demo`: the clip, database and task that ship with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from visup.runs.settings import WatchSettings


def demo_settings(every: int = 2) -> WatchSettings:
    """Settings for the shipped clip, as a user would give them to `visup watch`."""
    data = Path(str(files("visup"))) / "data"
    return WatchSettings(
        source=str(data / "sts87.mp4"),
        tasks=("dock",),
        models=data / "demo.models",
        actors={"satellite": ("spartan",), "arm": ("arm",)},
        every=every,
        fov_vertical_deg=38.0,
    )


def free_folder(preferred: Path) -> Path:
    """`preferred`, numbered if it exists: an earlier run is never overwritten."""
    if not preferred.exists():
        return preferred
    return next(p for n in range(2, 10**6) if not (p := Path(f"{preferred}-{n}")).exists())
