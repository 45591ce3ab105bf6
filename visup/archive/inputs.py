"""The files that a run was reasoned with, kept beside it: tasks with what they include, rules, zones.

A lake outlives the folders from which it was filled: so that a run can be reasoned about again years later,
with just the tasks and rules that it had, their texts are kept with it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from visup.agent.model.errors import OutputError
from visup.agent.storage.text_file import read_text_file
from visup.runs.settings import WatchSettings
from visup.tasks.checks.files import read_text, shipped_tasks

INDEX = "inputs.json"
_INCLUDE = re.compile(r'^[ \t]*include[ \t]+"([^"\n]+)"', re.MULTILINE)


@dataclass(frozen=True, slots=True)
class RunInputs:
    """The files of a run by their place beside it, and how its settings name them there.

    Attributes:
        texts: Relative path -> text.
        tasks: As `WatchSettings.tasks`, relative.
        rules: As `WatchSettings.rules`, relative.
        zones: As `WatchSettings.zones`, relative, or None.
    """

    texts: Mapping[str, str]
    tasks: tuple[str, ...] = ()
    rules: tuple[str, ...] = ()
    zones: str | None = None

    def files(self) -> dict[str, bytes]:
        """What is to be written: relative path -> content, with the index of it all."""
        told = {"tasks": self.tasks, "rules": self.rules, "zones": self.zones}
        index = json.dumps(told, indent=1, sort_keys=True) + "\n"
        return {INDEX: index.encode(), **{k: v.encode() for k, v in self.texts.items()}}


def run_inputs(settings: WatchSettings) -> RunInputs:
    """The files that some settings name and that reasoning depends on.

    Raises:
        VisupError: One cannot be read.
    """
    texts: dict[str, str] = {}
    tasks = tuple(_task(name, f"task-{n}", texts) for n, name in enumerate(settings.tasks, 1))
    rules = tuple(_copied(p, f"rules-{n}", texts) for n, p in enumerate(settings.rules, 1))
    zones = _copied(settings.zones, "zones", texts) if settings.zones else None
    return RunInputs(texts, tasks, rules, zones)


def with_inputs(settings: WatchSettings, folder: Path) -> WatchSettings:
    """The settings of a run with the files that stand beside it in place of those that it was given.

    Args:
        settings: As they were recorded.
        folder: Where the files of `RunInputs.files` were written to.

    Raises:
        OutputError: They are not there.
    """
    try:
        told = json.loads(read_text_file(folder / INDEX))
        tasks, rules, zones = told["tasks"], told["rules"], told["zones"]
        return replace(
            settings,
            tasks=tuple(str(folder / t) for t in tasks),
            rules=tuple(folder / r for r in rules),
            zones=folder / zones if zones else None,
        )
    except (OSError, ValueError, KeyError, TypeError) as fault:
        where = str(folder / INDEX)
        raise OutputError(f"the files of a run cannot be read ({fault})", where=where) from fault


def _task(name: str, place: str, texts: dict[str, str]) -> str:
    path, wanted = name, ""
    if not _is_task(name):
        path, _, wanted = name.rpartition(":")
    file = f"{path}.task" if path in shipped_tasks() and not Path(path).exists() else path
    root = f"inputs/{place}"
    texts[f"{root}/{Path(file).name}"] = text = read_text(path)
    for relative, included in _included(Path(file).parent, PurePosixPath(), text, {Path(file)}):
        texts[f"{root}/{relative}"] = included
    kept = f"{root}/{Path(file).name}"
    return f"{kept}:{wanted}" if wanted else kept


def _is_task(name: str) -> bool:
    return Path(name).exists() or name in shipped_tasks() or ":" not in name


def _included(
    root: Path, folder: PurePosixPath, text: str, known: set[Path]
) -> Iterator[tuple[str, str]]:
    """The files that a task includes, with those that they include, by their path from its folder."""
    for named in _INCLUDE.findall(text):
        relative = folder / named
        path = root / relative
        if path in known or not path.is_file():  # a shipped task is there wherever visup is
            continue
        known.add(path)
        found = read_text(path)
        yield str(relative), found
        yield from _included(root, relative.parent, found, known)


def _copied(path: Path, place: str, texts: dict[str, str]) -> str:
    kept = f"inputs/{place}/{path.name}"
    try:
        texts[kept] = read_text_file(path)
    except (OSError, UnicodeDecodeError) as fault:
        said = getattr(fault, "strerror", None) or fault
        raise OutputError(f"the file cannot be read ({said})", where=str(path)) from fault
    return kept
