"""Sinks that need nothing but Python: standard output, a file, a webhook."""

from __future__ import annotations

import json
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TextIO

from visup.agent.model.errors import OutputError, SettingsError

TIMEOUT_S = 5.0
TRIES = 4
FIRST_WAIT_S = 0.5


class JsonLines:
    """One JSON object a line, written out at once.

    Args:
        name: Of the sink.
        stream: Where to.
        owned: Whether to close it at the end.
    """

    def __init__(self, name: str, stream: TextIO, *, owned: bool = False) -> None:
        self.name = name
        self._stream = stream
        self._owned = owned

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Write one line."""
        self._stream.write(json_text(record) + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Close the file."""
        if self._owned:
            self._stream.close()


def to_stdout() -> JsonLines:
    """The sink `jsonl:-`."""
    return JsonLines("jsonl:-", sys.stdout)


def to_file(name: str, path: Path) -> JsonLines:
    """The sink of a file, which is appended to.

    Raises:
        OutputError: It cannot be opened.
    """
    try:
        return JsonLines(name, path.open("a", encoding="utf-8"), owned=True)
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(path)) from fault


class Webhook:
    """Posts each record as JSON to a URL.

    A server that cannot be reached or says that it is at fault (5xx, or 429) is tried again, each time
    after twice as long; any other refusal is final.

    Args:
        url: http or https.
        timeout_s: For one attempt, seconds.
        tries: Attempts for one record.
        wait: Waits so many seconds; an argument so that tests need not.

    Raises:
        SettingsError: It is no such URL.
    """

    def __init__(
        self,
        url: str,
        *,
        timeout_s: float = TIMEOUT_S,
        tries: int = TRIES,
        wait: Callable[[float], None] = time.sleep,
    ) -> None:
        if not url.lower().startswith(("http://", "https://")):
            raise SettingsError(f"--sink webhook:{url}", expected="an http or https address")
        self.name = f"webhook:{url}"
        self._url, self._timeout_s, self._tries, self._wait = url, timeout_s, tries, wait

    def deliver(self, record: Mapping[str, Any]) -> None:
        """Post one record.

        Raises:
            OSError: It was not taken.
        """
        for attempt in range(self._tries):
            try:
                self._post(json_text(record).encode())
            except urllib.error.HTTPError as fault:
                fault.close()
                if (fault.code < 500 and fault.code != 429) or attempt + 1 == self._tries:
                    raise
            except OSError:
                if attempt + 1 == self._tries:
                    raise
            else:
                return
            self._wait(FIRST_WAIT_S * 2**attempt)

    def close(self) -> None:
        """Nothing is held."""

    def _post(self, body: bytes) -> None:
        headers = {"Content-Type": "application/json", "User-Agent": "visup"}
        request = urllib.request.Request(self._url, body, headers, method="POST")
        with urllib.request.urlopen(request, timeout=self._timeout_s) as answer:
            answer.read(1)


def json_text(record: Mapping[str, Any]) -> str:
    """A record as one line of JSON."""
    return json.dumps(record, ensure_ascii=False, separators=(",", ":"), sort_keys=True)
