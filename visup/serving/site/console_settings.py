"""The console settings of a site, from its table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.serving.site.form import ConsoleTable
from visup.serving.site.placeholders import filled
from visup.serving.site.records import SiteConsole

MIN_TOKEN_LENGTH = 16
"""Characters, as in `visup console`."""


def console_of(
    table: ConsoleTable | None, folder: Path, environment: Mapping[str, str]
) -> SiteConsole | None:
    """The console of a site, or None.

    Args:
        table: The table of the site file.
        folder: Folder of the site file, to which file names are relative.
        environment: Values of placeholders.

    Raises:
        SettingsError: A token is too short, a placeholder cannot be replaced, or the folder does not exist.
    """
    if table is None:
        return None
    address = address_of(table.listen)
    assert address is not None  # the form requires one
    viewer = table.viewer_token
    return SiteConsole(
        address,
        _token(filled(table.token, environment, folder)),
        None if viewer is None else _token(filled(viewer, environment, folder)),
        table.names,
        None if table.save_to is None else _existing(folder / Path(table.save_to).expanduser()),
    )


def address_of(listen: str) -> tuple[str, int] | None:
    """Address and port of `ADDRESS:PORT`; None for an empty text."""
    host, colon, port = listen.rpartition(":")
    return (host.strip("[]"), int(port)) if colon else None


def _token(token: str) -> str:
    if len(token) < MIN_TOKEN_LENGTH or not token.isascii():
        raise SettingsError(
            "a token of the console is too short, or not of plain letters",
            expected=f"at least {MIN_TOKEN_LENGTH} letters and digits",
        )
    return token


def _existing(folder: Path) -> Path:
    if not folder.is_dir():
        raise SettingsError(
            f"there is no folder {folder} to save to", expected="one that the console may write to"
        )
    return folder
