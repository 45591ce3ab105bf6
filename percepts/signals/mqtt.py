"""Signals from an MQTT broker; needs `visup[mqtt]` (paho-mqtt, licensed EPL 2.0 or BSD 3-clause)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.percepts.signals.behaviour import NAME, Value

PORT = 1883
MAX_SIGNALS = 1000
LONGEST_WORD = 200


class MqttSignals:
    """The latest message of each topic; the last part of the topic names the signal.

    A payload is a number, `true`, `false` or a word, plain or as JSON; an empty one makes the signal
    unknown. Messages count from their arrival, so the video source must be live.

    Args:
        place: `HOST[:PORT]/TOPIC`, such as `broker/cell/#`.

    Raises:
        SettingsError: The address is malformed, or the broker cannot be reached.
        ExtraMissingError: paho-mqtt is not installed.
    """

    names: frozenset[str] = frozenset()

    def __init__(self, place: str) -> None:
        address, slash, self._topic = place.partition("/")
        host, _, port = address.partition(":")
        if not (host and slash and self._topic) or (port and not port.isdecimal()):
            raise SettingsError(f"--signal mqtt:{place}", expected="mqtt:HOST[:PORT]/TOPIC")
        try:
            from paho.mqtt import client
        except ModuleNotFoundError as missing:
            raise ExtraMissingError("signals from MQTT", "mqtt") from missing
        self._known: dict[str, Value] = {}
        self._client = client.Client(client.CallbackAPIVersion.VERSION2)
        self._client.on_connect = lambda *_: self._client.subscribe(self._topic)
        self._client.on_message = lambda _, __, message: self.take(message.topic, message.payload)
        try:
            self._client.connect(host, int(port or PORT))
        except OSError as fault:
            what = f"the broker of the signals cannot be reached ({fault.strerror or fault})"
            raise SettingsError(what, where=f"mqtt:{place}", hint="check host and port") from None
        self._client.loop_start()

    def at(self, time: float) -> Mapping[str, Value]:
        """The latest values."""
        return dict(self._known)

    def take(self, topic: str, payload: bytes) -> None:
        """Handle one message; anything but a signal is ignored."""
        name, value = topic.rpartition("/")[2], read_payload(payload)
        if not NAME.fullmatch(name):
            return
        if value is None:
            self._known.pop(name, None)
        elif name in self._known or len(self._known) < MAX_SIGNALS:
            self._known[name] = value


def read_payload(payload: bytes) -> Value | None:
    """A message as a value; None if empty or not a value."""
    text = payload[: 4 * LONGEST_WORD].decode("utf-8", errors="replace").strip()
    try:
        found: Any = json.loads(text)
    except (ValueError, RecursionError):
        return text[:LONGEST_WORD] or None
    if isinstance(found, bool):
        return found
    if isinstance(found, int | float):
        return float(found) if abs(found) < 1e300 and math.isfinite(found) else None
    return found[:LONGEST_WORD] or None if isinstance(found, str) else None
