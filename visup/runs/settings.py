"""What a run is given: the settings of `visup watch`, checked before anything starts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError


@dataclass(frozen=True, slots=True)
class WatchSettings:
    """All that a supervised run depends on besides the video itself.

    Attributes:
        source: File, folder of images, camera index or URL.
        tasks: Task files or names of shipped tasks; none for supervision without a task.
        models: Model database, or None to go without identities.
        rules: Rules files; the shipped safety rules when empty.
        actors: Actor -> names of the models that it may be.
        behaviours: Behaviours of the user's own: files, or `package.module:Class`.
        plugins: Names of installed behaviours to add.
        plugin_settings: Name of such a behaviour -> values for its settings.
        isolate: Names of behaviours that run in processes of their own.
        budgets: Whether behaviours are held to the budgets that they declare; for live sources.
        realtime: Whether frames for which visup is too slow are dropped; None for live sources alone.
        every: Use every n-th frame.
        fps: Frame rate to assume where the source has none, or None.
        fov_vertical_deg: Vertical field of view, degrees; None where it is not known.
        zones: Settings file with zones that rules can name, or None.
        patience_s: How long a camera or stream that drops is tried again, seconds.
        attention: Whether objects that are known well are matched less often (`rules/activation/`).
    """

    source: str
    tasks: tuple[str, ...] = ()
    models: Path | None = None
    rules: tuple[Path, ...] = ()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    behaviours: tuple[Path | str, ...] = ()
    plugins: tuple[str, ...] = ()
    plugin_settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    isolate: tuple[str, ...] = ()
    budgets: bool = False
    realtime: bool | None = None
    every: int = 1
    fps: float | None = None
    fov_vertical_deg: float | None = None
    zones: Path | None = None
    patience_s: float = 60.0
    attention: bool = False

    def __post_init__(self) -> None:
        if self.every < 1:
            raise SettingsError(f"--every is {self.every}", expected="1 or more")
        if self.fps is not None and not 0 < self.fps <= 1000:
            raise SettingsError(f"--fps is {self.fps}", expected="more than 0, at most 1000")
        fov = self.fov_vertical_deg
        if fov is not None and not 0 < fov < 180:
            raise SettingsError(f"--fov is {fov}", expected="degrees between 0 and 180")


def parse_actors(bindings: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Actors from `NAME=MODEL` or `NAME=MODEL,MODEL`.

    >>> parse_actors(["satellite=spartan,hubble", "arm=rms"])
    {'satellite': ('spartan', 'hubble'), 'arm': ('rms',)}

    Raises:
        SettingsError: One is not of that form, or an actor is bound twice.
    """
    actors: dict[str, tuple[str, ...]] = {}
    for binding in bindings:
        name, equals, models = binding.partition("=")
        names = tuple(m.strip() for m in models.split(",") if m.strip())
        if not (equals and name.strip() and names):
            raise SettingsError(
                f"--actor {binding!r} cannot be read",
                expected="NAME=MODEL, such as satellite=spartan201",
            )
        if name.strip() in actors:
            raise SettingsError(
                f"the actor '{name.strip()}' is bound twice",
                hint="separate alternatives by commas: NAME=MODEL,MODEL",
            )
        actors[name.strip()] = names
    return actors
