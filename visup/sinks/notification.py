"""Alerts by mail and chat, in words; needs `visup[serve]` (Apprise, licensed BSD 2-clause)."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.sinks.webhook import DeliveryError

EXPECTED = "an address that Apprise knows, such as mailto://USER:PASSWORD@HOST or slack://..."


class Notification:
    """Sends each record as a short message, with the picture of the alert if there is one.

    Args:
        address: Apprise URL: `mailto://...`, `slack://...`, `tgram://...` and a hundred more. Most contain a
            password or token, so none is ever shown.

    Raises:
        SettingsError: Apprise does not support the address.
        ExtraMissingError: Apprise is not installed.
    """

    def __init__(self, address: str) -> None:
        try:
            import apprise
        except ModuleNotFoundError as missing:
            raise ExtraMissingError("a sink for mail and chat", "serve") from missing
        scheme = address.partition("://")[0]
        self.name = f"notify:{scheme}"
        # Apprise logs addresses; faults are reported once, without them.
        logging.getLogger("apprise").setLevel(logging.CRITICAL)
        self._service = apprise.Apprise()
        if "://" not in address or not self._service.add(address):
            raise SettingsError(f"--sink notify:{scheme}://...", expected=EXPECTED)

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Send one record.

        Raises:
            DeliveryError: It was not accepted.
        """
        picture = record.get("snapshot")
        has_picture = isinstance(picture, str) and Path(picture).is_file()
        accepted = self._service.notify(
            title=title_of(record), body=body_of(record), attach=picture if has_picture else None
        )
        if not accepted:
            raise DeliveryError("the message was not accepted")

    def close(self) -> None:
        """Nothing to close."""


def title_of(record: Mapping[str, Any]) -> str:
    """The title of a message: camera and severity."""
    sender = record.get("camera") or record.get("source", "visup")
    if record.get("record") == "alert":
        over = "over: " if record.get("state") == "closed" else ""
        return f"{sender}: {over}{record.get('severity', 'alert')}"
    if record.get("record") == "verdict":
        return f"{sender}: the run has ended"
    return f"{sender}: notice"


def body_of(record: Mapping[str, Any]) -> str:
    """The body of a message: the sentence, its time, and links."""
    kind = record.get("record")
    sentence = record.get("text") if kind == "notice" else record.get("cause")
    if kind == "verdict":
        sentence = f"Verdict: {record.get('verdict') or 'none'}, after {record.get('steps')} steps."
    lines = [str(sentence)]
    if "at" in record:
        lines.append(f"At {record['at']}.")
    for word, key in (("Picture", "snapshot"), ("Clip", "clip")):
        if key in record:
            lines.append(f"{word}: {record[key]}")
    return "\n".join(lines)
