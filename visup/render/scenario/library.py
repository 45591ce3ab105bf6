"""The scenarios that ship with visup, and finding a scenario by name or file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.render.scenario.scenario import Scenario, load_scenario, parse_scenario

SCENARIOS = "scenarios"
"""Folder of the scenarios that ship with visup."""

BENCH = "bench"
"""Folder of the scenarios of the benchmark."""


def shipped_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, sorted, without those of the benchmark."""
    return _names(".")


def bench_names() -> tuple[str, ...]:
    """Names of the scenarios of the benchmark, sorted."""
    return _names(BENCH)


def _names(folder: str) -> tuple[str, ...]:
    files = (resources.files("visup.render") / SCENARIOS / folder).iterdir()
    return tuple(sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml")))


def shipped_scenario(name: str) -> Scenario:
    """A shipped scenario by its name, such as `sts87`, or `bench/pan` for one of the bench.

    Raises:
        SettingsError: There is none of that name.
    """
    known = (*shipped_names(), *(f"{BENCH}/{n}" for n in bench_names()))
    if name not in known:
        raise SettingsError(
            f"there is no scenario {name!r}",
            expected=f"a file, or one of {', '.join(known)}",
        )
    text = (resources.files("visup.render") / SCENARIOS / f"{name}.toml").read_text(
        encoding="utf-8"
    )
    return parse_scenario(text, f"{name}.toml")


def find_scenario(name_or_path: str) -> Scenario:
    """A scenario by the path of its file, or by the name of a shipped one.

    Raises:
        SettingsError: There is none, or the file is invalid.
        ErrorGroup: The file has several errors.
    """
    path = Path(name_or_path)
    if path.is_file() or path.suffix == ".toml":
        return load_scenario(path)
    return shipped_scenario(name_or_path)
