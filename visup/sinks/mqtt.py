"""Alerts to an MQTT broker; needs `visup[mqtt]` (paho-mqtt, licensed EPL 2.0 or BSD 3-clause)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.sinks.lines import TIMEOUT_S, json_text

PORT = 1883
QOS_AT_MIN_ONCE = 1


class Mqtt:
    """Publishes each record as JSON, at least once (QoS 1).

    Args:
        place: `HOST[:PORT]/TOPIC`.

    Raises:
        SettingsError: It is malformed.
        ExtraMissingError: paho-mqtt is not installed.
    """

    def __init__(self, target: str) -> None:
        address, slash, topic = target.partition("/")
        host, _, port = address.partition(":")
        if not (host and slash and topic) or (port and not port.isdecimal()):
            raise SettingsError(f"--sink mqtt:{target}", expected="mqtt:HOST[:PORT]/TOPIC")
        try:
            from paho.mqtt import client
        except ModuleNotFoundError as missing:
            raise ExtraMissingError("a sink for MQTT", "mqtt") from missing
        self.name = f"mqtt:{target}"
        self._topic = topic
        self._server = host, int(port or PORT)
        self._client = client.Client(client.CallbackAPIVersion.VERSION2)
        self._client.connect_timeout = TIMEOUT_S
        self._connected = False

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Publish one record and wait for the broker's acknowledgement.

        Raises:
            OSError, RuntimeError: The broker did not accept it.
        """
        if not self._connected:
            self._client.connect(*self._server)
            self._client.loop_start()
            self._connected = True
        message = self._client.publish(self._topic, json_text(record), qos=QOS_AT_MIN_ONCE)
        message.wait_for_publish(TIMEOUT_S)
        if not message.is_published():
            raise TimeoutError("the broker did not answer")

    def close(self) -> None:
        """Disconnect from the broker."""
        if self._connected:
            self._client.disconnect()
            self._client.loop_stop()
