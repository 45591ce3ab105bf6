"""The scenarios that ship with visup, and finding a scenario by name or file."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from visup.agent.errors import SettingsError
from visup.render.scenario import Scenario, load_scenario, parse_scenario


def shipped_names() -> tuple[str, ...]:
    """Names of the shipped scenarios, sorted."""
    files = resources.files("visup.render").iterdir()
    return tuple(sorted(f.name.removesuffix(".toml") for f in files if f.name.endswith(".toml")))


def shipped_scenario(name: str) -> Scenario:
    """A shipped scenario by its name.

    Raises:
        SettingsError: There is none of that name.
    """
    if name not in shipped_names():
        raise SettingsError(
            f"there is no scenario {name!r}",
            expected=f"a file, or one of {', '.join(shipped_names())}",
        )
    text = (resources.files("visup.render") / f"{name}.toml").read_text(encoding="utf-8")
    return parse_scenario(text, f"{name}.toml")


def find_scenario(word: str) -> Scenario:
    """A scenario by the path of its file, or by the name of a shipped one.

    Raises:
        SettingsError: There is none, or the file is not as it should be.
        ManyErrors: The file has several faults.
    """
    path = Path(word)
    if path.is_file() or path.suffix == ".toml":
        return load_scenario(path)
    return shipped_scenario(word)
