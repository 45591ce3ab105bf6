"""Secrets stay out of the site file: `${NAME}` is an environment variable, `${file:PATH}` a file's text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.agent.storage.text_file import read_text_file

PLACEHOLDER = re.compile(r"\$\{([^{}]*)\}")
_FILE = "file:"
_NAME = re.compile(r"[A-Za-z_]\w*")


def filled(text: str, environment: Mapping[str, str], folder: Path) -> str:
    """A text with its placeholders replaced.

    >>> filled("rtsp://guard:${PASSWORD}@cell/1", {"PASSWORD": "swordfish"}, Path("."))
    'rtsp://guard:swordfish@cell/1'

    Args:
        text: Text of the site file.
        environment: Values of variables.
        folder: Folder to which file names are relative.

    Raises:
        SettingsError: There is no such variable or file.
    """
    return PLACEHOLDER.sub(lambda found: _value(found[1], environment, folder), text)


def _value(name: str, environment: Mapping[str, str], folder: Path) -> str:
    if name.startswith(_FILE):
        return _text_of(folder / Path(name.removeprefix(_FILE)).expanduser())
    if not _NAME.fullmatch(name):
        raise SettingsError(
            f"'${{{name}}}' cannot be replaced", expected="${VARIABLE}, or ${file:PATH}"
        )
    if name not in environment:
        raise SettingsError(
            f"the environment has no variable {name}",
            hint=f"set it where visup is started; or keep it in a file: ${{{_FILE}PATH}}",
        )
    return environment[name]


def _text_of(path: Path) -> str:
    try:
        return read_text_file(path).strip()
    except OSError as fault:
        raise SettingsError(
            f"the file of a placeholder cannot be read ({fault.strerror})", where=str(path)
        ) from fault
    except UnicodeDecodeError as fault:
        raise SettingsError("the file of a placeholder is not text", where=str(path)) from fault
