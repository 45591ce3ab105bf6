"""Saves texts edited in the page under plain names in one configured folder."""

from __future__ import annotations

import re
from pathlib import Path

from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.storage.atomic import write_atomically
from visup.console.workbench.drafts import DraftKind, check_draft

SUFFIXES = {DraftKind.TASK: ".task", DraftKind.RULES: ".rules", DraftKind.ZONES: ".toml"}
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,62}")


def save_draft(folder: Path, kind: DraftKind, name: str, text: str, *, replace: bool) -> Path:
    """Save a text without mistakes.

    Args:
        folder: The folder.
        kind: Kind of text, which determines the suffix.
        name: File name without suffix.
        text: The text.
        replace: Whether to overwrite an existing file.

    Returns:
        The file.

    Raises:
        SettingsError: The name or the text is not valid, or the file exists.
        OutputError: It cannot be written.
    """
    if not _NAME.fullmatch(name):
        raise SettingsError(
            "this is no name for a file here",
            expected="letters, digits, hyphen and _, without an ending",
        )
    if not text.strip() or check_draft(kind, text).faults:
        raise SettingsError(
            "only a text without mistakes is saved", hint="correct what is listed below it"
        )
    path = folder / f"{name}{SUFFIXES[kind]}"
    if path.is_symlink() or (path.exists() and not (replace and path.is_file())):
        raise SettingsError(
            f"there is a file {path.name} already", hint="choose another name, or tick 'replace'"
        )
    try:
        write_atomically(path, text.encode() if text.endswith("\n") else f"{text}\n".encode())
    except (OSError, UnicodeEncodeError) as fault:
        reason = getattr(fault, "strerror", None) or fault
        raise OutputError(f"it cannot be saved: {reason}", where=path.name) from fault
    return path
