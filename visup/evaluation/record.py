"""The record of an evaluation on disk: version, settings, machine, figures."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from visup.agent.model.errors import OutputError
from visup.agent.storage.jsonable import to_jsonable
from visup.version import __version__

RECORD_VERSION = 1


def write_record(path: Path, figures: Mapping[str, Any], settings: Mapping[str, Any]) -> None:
    """Write figures with what is needed to compare them later.

    Raises:
        OutputError: The file cannot be written.
    """
    record = {
        "version": RECORD_VERSION,
        "settings": {"visup": __version__, **settings},
        "machine": machine(),
        **figures,
    }
    try:
        path.write_text(json.dumps(to_jsonable(record), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write: {error.strerror}", where=str(path)) from error


def machine() -> dict[str, Any]:
    """The machine, without names of hosts or people."""
    return {
        "system": platform.system(),
        "architecture": platform.machine(),
        "python": platform.python_version(),
        "cores": os.cpu_count(),
    }
