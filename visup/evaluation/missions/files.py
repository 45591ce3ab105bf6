"""Missions on disk: where they are, and their JSON files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError


def mission_folders(folder: Path) -> list[Path]:
    """A mission, or all missions in a folder, by name.

    Raises:
        SettingsError: There is none.
    """
    missions = [folder] if (folder / "mission.json").is_file() else []
    missions += sorted(p.parent for p in folder.glob("*/mission.json"))
    if not missions:
        raise SettingsError(
            "there is no mission here",
            where=str(folder),
            expected="mission.json, video.mp4, masks/ and truth.json, or folders that hold them",
        )
    return missions


def read_json(path: Path) -> dict[str, Any]:
    """A mission's JSON file.

    Raises:
        SettingsError: It is missing, or no JSON object.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SettingsError(f"this cannot be read: {error}", where=str(path)) from error
    if not isinstance(data, dict):
        raise SettingsError(
            "this is not the file of a mission", where=str(path), expected="a JSON object"
        )
    return data
