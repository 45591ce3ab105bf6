"""The input files of a run, saved with it: tasks with their includes, rules, zones.

A lake outlives the folders from which it was filled. The texts are saved so that the reasoning of a run can
be replayed years later with the same tasks and rules.
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
    """The files saved with a run, and how its settings name them.

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
        """The files to write: relative path -> content, including the index."""
        index_fields = {"tasks": self.tasks, "rules": self.rules, "zones": self.zones}
        index = json.dumps(index_fields, indent=1, sort_keys=True) + "\n"
        return {INDEX: index.encode(), **{k: v.encode() for k, v in self.texts.items()}}


def run_inputs(settings: WatchSettings) -> RunInputs:
    """The files named by the settings that reasoning depends on.

    Raises:
        VisupError: One cannot be read.
    """
    texts: dict[str, str] = {}
    tasks = tuple(_task(name, f"task-{n}", texts) for n, name in enumerate(settings.tasks, 1))
    rules = tuple(_copied(p, f"rules-{n}", texts) for n, p in enumerate(settings.rules, 1))
    zones = _copied(settings.zones, "zones", texts) if settings.zones else None
    return RunInputs(texts, tasks, rules, zones)


def with_inputs(settings: WatchSettings, folder: Path) -> WatchSettings:
    """The settings of a run with its saved files in place of the original ones.

    Args:
        settings: The recorded settings.
        folder: Folder with the files of `RunInputs.files`.

    Raises:
        OutputError: The files are missing.
    """
    try:
        index_fields = json.loads(read_text_file(folder / INDEX))
        tasks, rules, zones = index_fields["tasks"], index_fields["rules"], index_fields["zones"]
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
    path, task_name = name, ""
    if not _is_task(name):
        path, _, task_name = name.rpartition(":")
    file = f"{path}.task" if path in shipped_tasks() and not Path(path).exists() else path
    root = f"inputs/{place}"
    texts[f"{root}/{Path(file).name}"] = text = read_text(path)
    for relative, included in _included(Path(file).parent, PurePosixPath(), text, {Path(file)}):
        texts[f"{root}/{relative}"] = included
    saved = f"{root}/{Path(file).name}"
    return f"{saved}:{task_name}" if task_name else saved


def _is_task(name: str) -> bool:
    return Path(name).exists() or name in shipped_tasks() or ":" not in name


def _included(
    root: Path, folder: PurePosixPath, text: str, visited: set[Path]
) -> Iterator[tuple[str, str]]:
    """The files that a task includes, recursively, by their path from its folder."""
    for include in _INCLUDE.findall(text):
        relative = folder / include
        path = root / relative
        if path in visited or not path.is_file():  # shipped tasks are part of visup
            continue
        visited.add(path)
        found = read_text(path)
        yield str(relative), found
        yield from _included(root, relative.parent, found, visited)


def _copied(path: Path, place: str, texts: dict[str, str]) -> str:
    saved = f"inputs/{place}/{path.name}"
    try:
        texts[saved] = read_text_file(path)
    except (OSError, UnicodeDecodeError) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise OutputError(f"the file cannot be read ({reason})", where=str(path)) from fault
    return saved
