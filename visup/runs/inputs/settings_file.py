"""The settings file of a run: settings of behaviours, and parameters fitted to labelled runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.agent.plugins.settings import behaviour_tables, read_toml

IDENTITY = "identity"
EVIDENCE = "evidence"


def read_settings_file(path: Path) -> dict[str, Any]:
    """Settings by the names of `WatchSettings`.

    Args:
        path: TOML with tables `[behaviours.NAME]`, and perhaps `[identity]`.

    Raises:
        SettingsError: The file is missing, is not TOML, or has other content.
    """
    document = read_toml(path)
    identity = document.pop(IDENTITY, {})
    told: dict[str, Any] = {"plugin_settings": behaviour_tables(document, path)}
    if not (isinstance(identity, dict) and identity.keys() <= {EVIDENCE}):
        raise SettingsError(
            f"`{IDENTITY}` holds something unknown", where=str(path), expected="evidence = NUMBER"
        )
    if EVIDENCE in identity:
        told["vote_evidence"] = _number(identity[EVIDENCE], path)
    return told


def fitted_settings(evidence: float, how: str) -> str:
    """A settings file with fitted parameters.

    Args:
        evidence: Weight of a vote for an identity, log-likelihood units.
        how: What it was fitted to, a sentence.
    """
    return f"# {how}\n[{IDENTITY}]\n{EVIDENCE} = {evidence:.3f}\n"


def _number(value: Any, path: Path) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SettingsError(
            f"`{EVIDENCE}` is {value!r}", where=str(path), expected=f"{EVIDENCE} = NUMBER"
        )
    return float(value)
